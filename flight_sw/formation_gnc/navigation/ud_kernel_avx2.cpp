// Compiled for AVX2, and called only where the processor has it.
#if defined(__x86_64__)
#include "formation_gnc/navigation/ud_kernel_body.hpp"

namespace formation_gnc {

const ud_kernel::Loops ud_kernel::kAvx2 = loops<4>();

}  // namespace formation_gnc
#endif
