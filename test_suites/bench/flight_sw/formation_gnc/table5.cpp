// The paper's Table 5: GRAPHIC, SDCP, time update and integer ambiguity resolution, mean and
// maximum, native measured and on emulated ARM counted, with the ratios beside the paper's. Prints
// Markdown.
//
// Each call is of one function alone, at the epochs of half an hour of the reference mission.
// Native: the least of nine runs per call, so that what else the machine does is left out; then
// mean and maximum over the calls. ARM: instructions x CPI / clock, the same in every run, which is
// checked.

#include <orrery/harness/flight/flight_library.hpp>
#include <orrery/harness/flight/flight_process.hpp>
#include <orrery/harness/flight/processor_model.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "../../../unit/flight_sw/formation_gnc/navigation_scene.hpp"
#include "formation_gnc/navigation/navigation.hpp"

namespace orrery {
namespace {

constexpr int kFunctions = 4;
constexpr const char* kPorts[kFunctions] = {"graphic", "sdcp", "time_update", "integers"};

struct PaperRow {
  const char* function;
  double desktop_mean_us, desktop_max_us, board_mean_us, board_max_us;
};
// Bell & D'Amico, Table 5: Apple M3 Max and BCM2835.
constexpr PaperRow kPaper[kFunctions] = {{"GRAPHIC update", 344, 1120, 23'500, 156'000},
                                         {"SDCP update", 246, 804, 16'200, 101'000},
                                         {"time update", 26, 116, 2'200, 6'900},
                                         {"IAR", 2, 55, 500, 4'000}};

/// What each call of a function cost: ns, or instructions.
struct Costs {
  std::vector<double> of[kFunctions];
};

struct Measured {
  formation_gnc::GnssEpoch epoch;
  formation_gnc::Quaternion q_BI;
};

template <class Struct>
Bytes bytes_of(const Struct& s) {
  return {reinterpret_cast<const std::byte*>(&s), sizeof s};
}

class Flight {
 public:
  explicit Flight(const TargetAddress& target) : process_(options(target)) {
    process_.create(SimTime{}, 0);
  }

  Costs fly(const std::vector<NavigationScene::Epoch>& epochs) {
    constexpr int kWarmUp = 30;
    int k = 0;
    for (const NavigationScene::Epoch& e : epochs) {
      for (const auto& ephemeris : e.ephemerides[0]) call("ephemeris", bytes_of(ephemeris));
      if (!e.measured[0] || !e.measured[1]) continue;
      if (k++ == kWarmUp) begin();
      call("epoch_self", bytes_of(Measured{*e.measured[0], e.q_BI[0]}));
      call("epoch_other", bytes_of(Measured{*e.measured[1], e.q_BI[1]}));
      if (k > kWarmUp) filter_epoch();
    }
    return costs_;
  }

 private:
  static FlightProcessOptions options(const TargetAddress& target) {
    FlightProcessOptions o{.spacecraft = "table5", .library = "navigation_calls"};
    o.target = target;
    if (target.kind != TargetAddress::Kind::kHere) {
      o.execution_time = ExecutionTime::counted_work(0);
    }
    return o;
  }
  double call(const char* port, Bytes message) {
    for (const FlightPort& p : process_.ports()) {
      if (p.name != port) continue;
      const Duration before = process_.host_time_in_flight();
      if (process_.input(SimTime{}, 0, p, message) != CallOutcome::kDone) {
        throw std::runtime_error(std::string(port) + " was not done: " + process_.crash().message);
      }
      return process_.work() > 0
                 ? static_cast<double>(process_.work())
                 : static_cast<double>(to_ns(process_.host_time_in_flight() - before));
    }
    throw std::logic_error(std::string("no port ") + port);
  }
  void begin() {
    call("begin", {});
    std::uint32_t sizes[2] = {};
    const Bytes said = process_.output(0).data;
    std::memcpy(sizes, said.data(), std::min(said.size(), sizeof sizes));
    if (sizes[0] != sizeof(Measured) || sizes[1] != sizeof(formation_gnc::BroadcastEphemeris)) {
      throw std::runtime_error("the structs of that processor have other sizes");
    }
  }
  void filter_epoch() {
    constexpr std::byte kWho[2] = {std::byte{0}, std::byte{1}};
    costs_.of[2].push_back(call(kPorts[2], {}));
    for (const std::byte& who : kWho) costs_.of[0].push_back(call(kPorts[0], Bytes(&who, 1)));
    costs_.of[1].push_back(call(kPorts[1], {}));
    costs_.of[3].push_back(call(kPorts[3], {}));
  }

  FlightProcess process_;
  Costs costs_;
};

Costs native(const std::vector<NavigationScene::Epoch>& epochs, int runs) {
  Costs least = Flight({}).fly(epochs);
  for (int run = 1; run < runs; ++run) {
    const Costs costs = Flight({}).fly(epochs);
    for (int f = 0; f < kFunctions; ++f) {
      for (std::size_t k = 0; k < least.of[f].size(); ++k) {
        least.of[f][k] = std::min(least.of[f][k], costs.of[f][k]);
      }
    }
  }
  return least;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}
double most(const std::vector<double>& values) {
  return *std::max_element(values.begin(), values.end());
}

void print(const char* emulator, const ProcessorModel& model, const Costs& here, const Costs& arm) {
  const double us = 1e6 * model.cycles_per_instruction / model.clock_Hz;
  std::printf("\n%s as %s, CPI %.1f\n\n", emulator, model.name.c_str(),
              model.cycles_per_instruction);
  std::printf(
      "| | native mean, max us | ARM instructions mean, max | ARM mean, max us | ratio of means, "
      "of maxima | the paper's |\n|---|---|---|---|---|---|\n");
  for (int f = 0; f < kFunctions; ++f) {
    const double here_mean = 1e-3 * mean(here.of[f]), here_max = 1e-3 * most(here.of[f]);
    const double arm_mean = mean(arm.of[f]), arm_max = most(arm.of[f]);
    const PaperRow& p = kPaper[f];
    std::printf("| %s | %.1f, %.1f | %.0f, %.0f | %.0f, %.0f | %.0f, %.0f | %.0f, %.0f |\n",
                p.function, here_mean, here_max, arm_mean, arm_max, us * arm_mean, us * arm_max,
                us * arm_mean / here_mean, us * arm_max / here_max,
                p.board_mean_us / p.desktop_mean_us, p.board_max_us / p.desktop_max_us);
  }
}

bool emulated(const char* emulator) {
  try {
    find_flight_library("navigation_calls@" + emulated_processor(parse_target_address(emulator)));
  } catch (const std::invalid_argument& missing) {
    std::printf("\n%s: skipped, %s\n", emulator, missing.what());
    return false;
  }
  if (std::system("command -v qemu-arm > /dev/null") == 0) return true;
  std::printf("\n%s: skipped, qemu-arm is not installed (Debian package qemu-user)\n", emulator);
  return false;
}

void compare(const char* emulator, const char* model, const Costs& here,
             const std::vector<NavigationScene::Epoch>& epochs) {
  if (!emulated(emulator)) return;
  const TargetAddress target = parse_target_address(emulator);
  const Costs arm = Flight(target).fly(epochs), again = Flight(target).fly(epochs);
  for (int f = 0; f < kFunctions; ++f) {
    if (arm.of[f] != again.of[f]) throw std::runtime_error("two runs counted differently");
  }
  print(emulator, processor_model(model), here, arm);
}

}  // namespace
}  // namespace orrery

int main(int argc, char** argv) {
  using namespace orrery;
  const bool brief = argc > 1 && std::string(argv[1]) == "--brief";
  NavigationScene scene;
  std::vector<NavigationScene::Epoch> epochs;
  for (int k = 0; k < (brief ? 40 : 180); ++k) epochs.push_back(scene.next());
  const Costs here = native(epochs, brief ? 1 : 9);
  compare("qemu-arm", "cortex-a8 1 GHz", here, epochs);
  compare("qemu-arm1176", "arm1176 700 MHz", here, epochs);
  return 0;
}
