/// Equations that contradict each other, found before the interior-point method starts: it cannot
/// see them, since its linear systems have no solution then.
#pragma once

#include "formation_gnc/control/socp_kkt.hpp"

namespace formation_gnc {

/// True if a row of A is a combination of rows before it and b is not. Then `y` proves it: A'y = 0
/// and b'y < 0.
bool find_contradiction(const ConeProgram& program, Eigen::VectorXd* y);

}  // namespace formation_gnc
