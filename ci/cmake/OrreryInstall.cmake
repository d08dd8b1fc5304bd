# install(EXPORT) and orreryConfig.cmake
