# What a user calls: orrery_add_flight_library and orrery_add_test. The same file serves the build tree
# and an installed Orrery.
