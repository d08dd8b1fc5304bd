#include <orrery/harness/flight/processor_model.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <cmath>
#include <stdexcept>

namespace orrery {

// One Dhrystone MIPS is 1757 Dhrystones a second (the VAX 11/780's), so D DMIPS per MHz are
// 1e6 / (1757 D) cycles for one, and one is some 330 instructions of a 32-bit RISC.
const std::vector<ProcessorModel>& processor_models() {
  static const std::vector<ProcessorModel> kModels = {
      {"arm1176 700 MHz", 700e6, 1.4,
       "ARM states 1.25 DMIPS/MHz for the ARM1176JZF-S: 455 cycles for some 330 instructions; for "
       "soft float, which is integer code (qemu-arm1176)"},
      {"cortex-a8 1 GHz", 1e9, 4.0,
       "Cortex-A8 Technical Reference Manual, VFPLite: 9 to 17 cycles for an addition or product "
       "in "
       "double precision, not pipelined; with 0.9 cycles for the rest (2.0 DMIPS/MHz) and three in "
       "ten "
       "instructions of floating point (qemu-arm)"},
      {"leon3-class", 100e6, 1.4,
       "Gaisler states 1.4 DMIPS/MHz for the LEON3: 407 cycles for some 330 instructions, and a "
       "pipelined FPU; 0.2 for cache misses. ARM's hard-float count stands in for SPARC's "
       "(qemu-arm)"},
  };
  return kModels;
}

const ProcessorModel& processor_model(std::string_view name) {
  std::string known;
  for (const ProcessorModel& model : processor_models()) {
    if (model.name == name) return model;
    known += (known.empty() ? "" : ", ") + model.name;
  }
  throw std::invalid_argument("processor_model: \"" + std::string(name) + "\" is not one of " +
                              known);
}

ExecutionTime execution_time_on(const ProcessorModel& processor, Duration base) {
  const auto require = [&](const char* what, double value) {
    if (value > 0 && std::isfinite(value)) return;
    throw std::invalid_argument("ProcessorModel \"" + processor.name + "\": " + what + " = " +
                                to_text(value) + "; it is above 0, and finite");
  };
  require("clock_Hz", processor.clock_Hz);
  require("cycles_per_instruction", processor.cycles_per_instruction);
  return ExecutionTime::counted_work(1e9 * processor.cycles_per_instruction / processor.clock_Hz,
                                     base);
}

}  // namespace orrery
