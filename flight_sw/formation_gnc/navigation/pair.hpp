/// Two doubles that go through the same operations: one vector register where there is one. Element
/// by element, so the bits are those of scalar code.
#pragma once

namespace formation_gnc {

typedef double Pair __attribute__((vector_size(16)));

}  // namespace formation_gnc
