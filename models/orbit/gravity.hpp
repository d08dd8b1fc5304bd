/// Gravity of a rotating body by spherical harmonics.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>
#include <orrery/models/frames/vector.hpp>
#include <orrery/models/orbit/gravity_field.hpp>

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace orrery {

/// How a sum is carried out: two, four or eight doubles at a time. All give the same bits.
enum class VectorPath { kPlain, kAvx2, kAvx512 };
std::string_view to_string(VectorPath path);

/// Acceleration of a GravityField.
///
/// Method      Cunningham, Celestial Mechanics 2 (1970): the gradient of the term (n, m) is made of
///             the terms of degree n + 1 and orders m - 1, m, m + 1, without a singularity at the
///             poles. Per order a recursion over the degree in monic polynomials of z/r; every
///             normalisation and derivative factor is folded into the coefficients once, at
///             construction, in long double.
/// Bits        Eight orders run side by side, each summed on its own in one order, no fused
///             multiply-add: one, two or eight lanes at a time, alone or in a batch, with any
///             compiler or optimisation, give the same bits.
/// Frames      ECEF in, ECEF out. Rotating to ECI is the caller's step (gravity_force.hpp).
/// Valid for   |r| at or above the reference radius; inside it the series need not converge.
/// Threads     Immutable after construction; calls keep everything on the stack. Copies share the
///             coefficients.
/// Checked by  test_suites/unit/models/orbit/gravity_test.cpp and
///             test_suites/validation/models/orbit/gravity_test.cpp
class HarmonicGravity {
 public:
  /// @param field   Coefficients, with the mu and radius they were estimated with.
  /// @param degree  Highest degree and order summed, 2 <= degree <= field.degree().
  /// @param path    For tests and benchmarks. Default: the widest that this processor has.
  /// @throws std::out_of_range      `degree` outside that range.
  /// @throws std::invalid_argument  this processor does not have `path`.
  HarmonicGravity(const GravityField& field, int degree, std::optional<VectorPath> path = {});

  /// Acceleration [m/s^2] at `r_ECEF` [m], central term included. No allocation.
  /// @throws std::domain_error  |r_ECEF| below the reference radius, or not finite.
  Vec3 acceleration_ECEF(const Vec3& r_ECEF) const;

  /// The same without the central term -mu r/|r|^3: the sum from degree 2, so nothing cancels.
  Vec3 perturbation_ECEF(const Vec3& r_ECEF) const;

  /// The same at several positions, as for spacecraft that fly together: two at a time share the
  /// coefficients. To the bit what the single calls give.
  /// @throws std::invalid_argument  sizes differ. @throws std::domain_error  as above; nothing is
  ///                                written then.
  void accelerations_ECEF(std::span<const Vec3> r_ECEF, std::span<Vec3> a_ECEF) const;
  void perturbations_ECEF(std::span<const Vec3> r_ECEF, std::span<Vec3> a_ECEF) const;

  int degree() const { return degree_; }
  double mu_m3ps2() const { return mu_m3ps2_; }
  double radius_m() const { return radius_m_; }
  VectorPath path() const { return path_; }

  /// Those of this processor, narrowest first.
  static std::vector<VectorPath> available_paths();

 private:
  struct Coefficients;

  void require_valid(const Vec3& r_ECEF) const;
  Vec3 central(const Vec3& r_ECEF) const;
  Vec3 sum_one(const Vec3& r_ECEF) const;
  void sum_two(const Vec3* r_ECEF, Vec3* a_ECEF) const;

  int degree_;
  double mu_m3ps2_, radius_m_;
  VectorPath path_;
  std::shared_ptr<const Coefficients> coefficients_;
};

}  // namespace orrery
