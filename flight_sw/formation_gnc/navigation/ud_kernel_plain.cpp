// For any processor.
#include "formation_gnc/navigation/ud_kernel_body.hpp"

namespace formation_gnc {

const ud_kernel::Loops ud_kernel::kPlain = loops<2>();

}  // namespace formation_gnc
