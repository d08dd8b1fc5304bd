// The case study's transfer, 20 h from standby to science, as benchmarks fly it.
#pragma once

#include <orrery/orrery.hpp>

#include <cstddef>

#include "formation_gnc/formation_gnc_messages.h"

namespace orrery::bench {

constexpr Duration kTransfer = 20h;

/// Both spacecraft fly formation_gnc: GNSS every 10 s, all forces of Table 1, all models.
inline FormationOptions telescope(bool record) {
  FormationOptions options{.flight = {.library = "formation_gnc", .heap_bytes = 50_MB},
                           .run = RunId{.seed = 1}};
  options.world.record = record;
  return missions::visors_like(std::move(options));
}

/// From half an hour after now to kTransfer, said at 10 min.
inline void command_transfer(FormationWorld& world) {
  const std::int64_t start_ns = to_ns(world.now());
  const formation_gnc_command c = {.opcode = FORMATION_GNC_UPLOAD,
                                   .mode = FORMATION_GNC_TRANSFER,
                                   .observations = 0,
                                   .every = 0,
                                   .number = 1,
                                   .t_ns = start_ns + Duration(30min).count(),
                                   .end_ns = start_ns + kTransfer.count(),
                                   .a_m = 0,
                                   .b_m = 0};
  std::byte message[FORMATION_GNC_COMMAND_BYTES];
  formation_gnc_put_command(reinterpret_cast<unsigned char*>(message), &c);
  world.ground().command("dsc", at(10min), message);
}

}  // namespace orrery::bench
