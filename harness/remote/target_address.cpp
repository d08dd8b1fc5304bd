#include <orrery/harness/remote/target_address.hpp>

#include <charconv>
#include <stdexcept>

namespace orrery {
namespace {

using Kind = TargetAddress::Kind;

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw std::invalid_argument(
      "target \"" + std::string(text) + "\": " + why +
      "; it is exec:COMMAND, unix:PATH, tcp:HOST:PORT, serial:DEVICE:BAUD, qemu-arm, "
      "qemu-arm1176 or qemu-aarch64, the last three also with the :PORT of a debugger");
}

// What stands behind the last ':' of "where:number".
std::uint32_t take_number(std::string_view text, std::string& where, std::uint32_t most) {
  const std::size_t colon = where.rfind(':');
  if (colon == std::string::npos || colon == 0) refuse(text, "a number is missing behind ':'");
  const char* begin = where.data() + colon + 1;
  const char* end = where.data() + where.size();
  std::uint32_t number = 0;
  const auto [at, error] = std::from_chars(begin, end, number);
  if (error != std::errc{} || at != end || number == 0 || number > most) {
    refuse(text,
           "\"" + std::string(begin, end) + "\" is not a number from 1 to " + std::to_string(most));
  }
  where.resize(colon);
  return number;
}

const char* prefix_of(Kind kind) {
  static constexpr const char* kPrefixes[] = {"", "exec:", "unix:", "tcp:", "serial:", ""};
  return kPrefixes[static_cast<int>(kind)];
}

// Debian's emulators and the libraries of its cross compilers.
struct Emulator {
  const char *name, *processor, *command;
};
constexpr Emulator kEmulators[] = {
    {"qemu-arm", "armhf", "qemu-arm -L /usr/arm-linux-gnueabihf"},
    {"qemu-arm1176", "armel", "qemu-arm -cpu arm1176 -L /usr/arm-linux-gnueabi"},
    {"qemu-aarch64", "arm64", "qemu-aarch64 -L /usr/aarch64-linux-gnu"}};

const Emulator& emulator_of(const TargetAddress& address) {
  for (const Emulator& emulator : kEmulators) {
    if (address.where == emulator.name) return emulator;
  }
  throw std::invalid_argument("target " + to_string(address) + " is no emulator");
}

}  // namespace

std::string emulated_processor(const TargetAddress& address) {
  return emulator_of(address).processor;
}

TargetAddress emulator_command(const TargetAddress& address, const std::string& program,
                               const std::string& library) {
  return {
      .kind = Kind::kExec,
      .where = std::string(emulator_of(address).command) + " '" + program + "' '" + library + "'"};
}

TargetAddress parse_target_address(std::string_view text) {
  for (const Emulator& emulator : kEmulators) {
    if (text == emulator.name) return {.kind = Kind::kEmulator, .where = emulator.name};
    if (!text.starts_with(std::string(emulator.name) + ":")) continue;
    TargetAddress address{.kind = Kind::kEmulator, .where = std::string(text)};
    address.port = take_number(text, address.where, 65535);
    return address;
  }
  for (const Kind kind : {Kind::kExec, Kind::kUnix, Kind::kTcp, Kind::kSerial}) {
    const std::string_view prefix = prefix_of(kind);
    if (!text.starts_with(prefix)) continue;
    TargetAddress address{.kind = kind, .where = std::string(text.substr(prefix.size()))};
    if (address.where.empty()) refuse(text, "nothing follows \"" + std::string(prefix) + "\"");
    if (kind == Kind::kTcp) address.port = take_number(text, address.where, 65535);
    if (kind == Kind::kSerial) address.port = take_number(text, address.where, 4'000'000);
    return address;
  }
  refuse(text, "it names no way to get there");
}

std::string to_string(const TargetAddress& address) {
  std::string text = prefix_of(address.kind) + address.where;
  if (address.port != 0) text += ":" + std::to_string(address.port);
  return text;
}

}  // namespace orrery
