/// Two doubles that go through the same operations: one vector register where there is one. Element
/// by element, so the bits are those of scalar code.
#pragma once

namespace formation_gnc {

// Aligned as doubles are: flight heaps of 8-byte alignment must do.
typedef double Pair __attribute__((vector_size(16), aligned(8)));

}  // namespace formation_gnc
