/// Gravity of a rotating body by spherical harmonics.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>
#include <orrery/models/frames/vector.hpp>
#include <orrery/models/orbit/gravity_field.hpp>

#include <array>
#include <string>
#include <vector>

namespace orrery {

/// Acceleration of a GravityField.
///
/// Method      Pines, AIAA J. 11(11) 1973: the gradient in direction cosines, without a singularity
/// at
///             the poles. Per order m a recursion over the degree n in monic polynomials of z/r,
///             all normalisation and derivative factors folded into the coefficients once, at
///             construction. Four orders run side by side, each summed on its own, so vectors of
///             any width give the same bits.
/// Frames      ECEF in, ECEF out. Rotating to ECI is the caller's step (gravity_force.hpp).
/// Valid for   |r| at or above the reference radius; inside it the series need not converge.
/// Threads     Immutable after construction; calls keep everything on the stack.
/// Checked by  test_suites/unit/models/orbit/gravity_test.cpp and
///             test_suites/validation/models/orbit/gravity_test.cpp
class HarmonicGravity {
 public:
  /// @param field   Coefficients, with the mu and radius they were estimated with.
  /// @param degree  Highest degree and order summed, 2 <= degree <= field.degree().
  /// @throws std::out_of_range  `degree` outside that range.
  HarmonicGravity(const GravityField& field, int degree);

  /// Acceleration [m/s^2] at `r_ECEF` [m], central term included. No allocation.
  /// @throws std::domain_error  |r_ECEF| below the reference radius, or not finite.
  Vec3 acceleration_ECEF(const Vec3& r_ECEF) const;

  /// The same without the central term -mu r/|r|^3: the sum from degree 2, so nothing cancels.
  Vec3 perturbation_ECEF(const Vec3& r_ECEF) const;

  int degree() const { return degree_; }
  double mu_m3ps2() const { return mu_m3ps2_; }
  double radius_m() const { return radius_m_; }

  static constexpr int kLanes = 4;  // orders side by side

 private:
  using Lanes = std::array<double, kLanes>;
  // What one degree n contributes to four orders.
  struct alignas(32) Row {
    Lanes gamma;             // recursion: b_n = z b_(n-1) - gamma b_(n-2)
    Lanes C, S;              // for the sums over this order
    Lanes C_below, S_below;  // order m - 1, for the derivative along z
  };
  struct OrderSums;

  void sum_order_block(int block, double z, double rho2, OrderSums* sums) const;
  void fill_row(const GravityField& field, const std::vector<double>& scale, int n, int block,
                Row& row) const;
  double checked_radius(const Vec3& r_ECEF) const;

  int degree_;
  double mu_m3ps2_, radius_m_;
  std::vector<Row> rows_;                 // block after block, n from the block's first order
  std::vector<std::size_t> block_start_;  // in rows_
};

}  // namespace orrery
