/// Where a flight process runs that does not run in this program.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#include <string>
#include <string_view>

namespace orrery {

/// What --orrery_target names behind SPACECRAFT=.
struct TargetAddress {
  enum class Kind : std::uint8_t {
    kHere,      // in this program: what a process is without a target
    kExec,      // exec:COMMAND     a command of /bin/sh that serves its standard input and output
    kUnix,      // unix:PATH        a Unix socket that listens
    kTcp,       // tcp:HOST:PORT    likewise; HOST is an IPv4 address or a name, PORT 1 to 65535
    kSerial,    // serial:DEVICE:BAUD
    kEmulator,  // qemu-arm, qemu-arm1176 or qemu-aarch64: as kExec, with the library that CROSS
                // built
  };
  Kind kind = Kind::kHere;
  std::string where = {};  // the command, path, host or device
  std::uint32_t port = 0;  // or the baud rate
};

/// @throws std::invalid_argument  with what was written and what can be.
TargetAddress parse_target_address(std::string_view text);
std::string to_string(const TargetAddress& address);

/// @pre kind is kEmulator. Which of CROSS's processors it emulates: "armhf".
std::string emulated_processor(const TargetAddress& address);
/// @pre kind is kEmulator. How to run a program there that serves a library.
TargetAddress emulator_command(const TargetAddress& address, const std::string& program,
                               const std::string& library);

}  // namespace orrery
