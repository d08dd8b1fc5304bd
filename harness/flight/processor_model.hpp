/// Processors on which flight code is timed by the instructions that it executes.
#pragma once

#include <orrery/harness/flight/execution_time.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// A call takes instructions x cycles_per_instruction / clock_Hz.
///
/// Valid for  code whose mix of instructions is that of the code which CPI was found with. Caches,
///            pipelines and memory are in CPI as a mean, so a worst case is not modelled.
/// CPI        those of processor_models() are estimates from what is published of the processor,
///            within a factor of two; one measurement on the hardware gives the true one for one's
///            own code (harness/remote/README.md, Calibration).
struct ProcessorModel {
  std::string name = {};              // "arm1176 700 MHz"
  double clock_Hz = 1e9;              // above 0
  double cycles_per_instruction = 1;  // above 0
  std::string origin = {};            // of that figure
};

/// arm1176 700 MHz, cortex-a8 1 GHz, leon3-class.
const std::vector<ProcessorModel>& processor_models();
/// @throws std::invalid_argument  no model has that name; the message has those that there are.
const ProcessorModel& processor_model(std::string_view name);
/// base + instructions x CPI / clock, for processes on a target that counts them: an emulator
/// (harness/remote). Repeats exactly for one binary of the library.
/// @throws std::invalid_argument  clock or CPI is not above 0 and finite.
ExecutionTime execution_time_on(const ProcessorModel& processor, Duration base = Duration{0});
inline ExecutionTime execution_time_on(std::string_view processor) {
  return execution_time_on(processor_model(processor));
}

}  // namespace orrery
