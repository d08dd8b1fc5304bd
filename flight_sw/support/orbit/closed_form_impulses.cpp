#include "closed_form_impulses.hpp"

#include <cmath>

namespace flight_support {
namespace {

// Rows a*da, a*de along the phase, a*dl: in this order of precedence, as the number of burns
// allows.
struct TangentialSystem {
  double row[3][kMaxOpportunities];
  double right[3];
};

TangentialSystem tangential_system(const BurnChoice& choice, const RelativeElements& miss) {
  const double c = std::cos(choice.in_plane_phase_rad), s = std::sin(choice.in_plane_phase_rad);
  TangentialSystem system;
  for (int k = 0; k < choice.count; ++k) {
    const Matrix<6, 3>& G = choice.in_plane[k]->effect;
    system.row[0][k] = G(kDa, 1);
    system.row[1][k] = c * G(kDex, 1) + s * G(kDey, 1);
    system.row[2][k] = G(kDl, 1);
  }
  system.right[0] = miss[kDa];
  system.right[1] = c * miss[kDex] + s * miss[kDey];
  system.right[2] = miss[kDl];
  return system;
}

template <int N>
bool solve_square(const TangentialSystem& system, double* p) {
  Matrix<N, N> A;
  Vector<N> b, x;
  for (int r = 0; r < N; ++r) {
    for (int c = 0; c < N; ++c) A(r, c) = system.row[r][c];
    b[r] = system.right[r];
  }
  if (!solve(A, b, &x)) return false;
  for (int k = 0; k < N; ++k) p[k] += x[k];
  return true;
}

// The smallest p, in the sense of least squares, that meets three equations: p = A^T (A A^T)^-1 b.
bool solve_least(const TangentialSystem& system, int count, double* p) {
  Matrix<3, 3> AAt;
  Vector<3> b, y;
  double scale[3];
  for (int r = 0; r < 3; ++r) {
    double largest = 0.0;
    for (int k = 0; k < count; ++k) largest = std::fmax(largest, std::fabs(system.row[r][k]));
    if (!(largest > 0.0)) return false;
    scale[r] = 1.0 / largest;
    b[r] = scale[r] * system.right[r];
  }
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < count; ++k) {
        AAt(r, c) += scale[r] * system.row[r][k] * scale[c] * system.row[c][k];
      }
    }
  }
  if (!solve(AAt, b, &y)) return false;
  for (int k = 0; k < count; ++k) {
    for (int r = 0; r < 3; ++r) p[k] += scale[r] * system.row[r][k] * y[r];
  }
  return true;
}

bool add_tangential(const BurnChoice& choice, const RelativeElements& miss, double* p) {
  const TangentialSystem system = tangential_system(choice, miss);
  switch (choice.count) {
    case 1:
      return solve_square<1>(system, p);
    case 2:
      return solve_square<2>(system, p);
    case 3:
      return solve_square<3>(system, p);
    default:
      return solve_least(system, choice.count, p);
  }
}

// A part that the burns do in shares; its sign alternates as its effect does.
void add_shared(int count, const double* share, const double* effect, double miss, double* part) {
  double total = 0.0;
  for (int k = 0; k < count; ++k) total += share[k] * std::fabs(effect[k]);
  if (!(total > 0.0)) return;
  for (int k = 0; k < count; ++k) part[k] += std::copysign(share[k], effect[k]) * miss / total;
}

// What each burn does to a*de across the phase by its radial part, to a*di by its normal part.
void add_radial_and_normal(const BurnChoice& choice, const RelativeElements& miss,
                           Impulses* impulses) {
  const double c = std::cos(choice.in_plane_phase_rad), s = std::sin(choice.in_plane_phase_rad);
  const double cn = std::cos(choice.normal_phase_rad), sn = std::sin(choice.normal_phase_rad);
  double share[kMaxOpportunities], across[kMaxOpportunities], normal[kMaxOpportunities];
  for (int k = 0; k < choice.count; ++k) {
    // Without any tangential part the shares are equal.
    share[k] = std::fabs(impulses->tangential[k]) + 1e-9;
    const Matrix<6, 3>& G = choice.in_plane[k]->effect;
    across[k] = -s * G(kDex, 0) + c * G(kDey, 0);
    const Matrix<6, 3>& H = choice.normal[k]->effect;
    normal[k] = cn * H(kDix, 2) + sn * H(kDiy, 2);
  }
  add_shared(choice.count, share, across, -s * miss[kDex] + c * miss[kDey], impulses->radial);
  add_shared(choice.count, share, normal, cn * miss[kDix] + sn * miss[kDiy], impulses->normal);
}

// Equal shares of a*de along the phase, for more burns than equations.
void start_with_equal_shares(const BurnChoice& choice, const RelativeElements& miss, double* p) {
  const TangentialSystem system = tangential_system(choice, miss);
  double share[kMaxOpportunities];
  for (int k = 0; k < choice.count; ++k) share[k] = 1.0;
  add_shared(choice.count, share, system.row[1], system.right[1], p);
}

}  // namespace

bool solve_impulses(const BurnChoice& choice, const RelativeElements& miss, Impulses* impulses) {
  *impulses = Impulses();
  if (choice.count > 3) start_with_equal_shares(choice, miss, impulses->tangential);
  // The parts disturb each other by J2 and eccentricity only, and a*dl by the radial ones: what is
  // left shrinks a hundredfold per round.
  for (int round = 0; round < 3; ++round) {
    const RelativeElements left = miss - effect_of(choice, *impulses);
    if (!add_tangential(choice, left, impulses->tangential)) return false;
    add_radial_and_normal(choice, left, impulses);
  }
  return true;
}

RelativeElements effect_of(const BurnChoice& choice, const Impulses& impulses) {
  RelativeElements sum;
  for (int k = 0; k < choice.count; ++k) {
    sum = sum + choice.in_plane[k]->effect * vec3(impulses.radial[k], impulses.tangential[k], 0.0) +
          choice.normal[k]->effect * vec3(0.0, 0.0, impulses.normal[k]);
  }
  return sum;
}

double delta_v_mps(const BurnChoice& choice, const Impulses& impulses) {
  double sum = 0.0;
  for (int k = 0; k < choice.count; ++k) {
    const double r = impulses.radial[k], t = impulses.tangential[k], n = impulses.normal[k];
    sum += choice.in_plane[k] == choice.normal[k] ? std::sqrt(r * r + t * t + n * n)
                                                  : std::sqrt(r * r + t * t) + std::fabs(n);
  }
  return sum;
}

}  // namespace flight_support
