/// Coefficients of a body's gravity field, from the compiled-in model or from an ICGEM file.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// Fully normalised spherical harmonic coefficients with the mu and radius they were estimated
/// with.
///
/// Format   ICGEM .gfc, static fields: a header up to `end_of_head`, then one line `gfc n m C S`
/// per
///          coefficient in any order (columns after S are ignored, Fortran exponents accepted).
///          Degree 0 and 1 may be left out; they are 1 and 0.
/// Errors   Everything that does not read as a complete field throws std::invalid_argument with the
///          source's name and the line: a file cut short, a missing, repeated, malformed or
///          non-finite or implausibly large coefficient, an unnormalised or time-variable field,
///          something that is not text.
/// Checked  test_suites/unit/models/orbit/gravity_field_test.cpp, test_suites/fuzz
class GravityField {
 public:
  /// GGM05S to 60x60, zero tide, compiled in (models/data). Ries et al. 2016.
  static GravityField ggm05s();

  /// @param degree  Read up to this degree only; the file must be complete to it. Default: all that
  ///                its header announces. At least 2, at most 360.
  /// @throws std::invalid_argument  see above; also a file that cannot be read.
  static GravityField load(const std::string& path, std::optional<int> degree = {});

  /// The same for text that is already in memory; `source_name` appears in messages.
  static GravityField parse(std::string_view text, std::string_view source_name,
                            std::optional<int> degree = {});

  const std::string& name() const { return name_; }
  /// "zero_tide", "tide_free" or as the header says; empty if it does not.
  const std::string& tide_system() const { return tide_system_; }
  int degree() const { return degree_; }
  double mu_m3ps2() const { return mu_m3ps2_; }
  double radius_m() const { return radius_m_; }

  /// Fully normalised. @throws std::out_of_range  unless 0 <= m <= n <= degree().
  double C(int n, int m) const { return C_[index_of(n, m)]; }
  double S(int n, int m) const { return S_[index_of(n, m)]; }

 private:
  friend class GravityFieldReader;
  GravityField() = default;
  std::size_t index_of(int n, int m) const;

  std::string name_, tide_system_;
  int degree_ = 0;
  double mu_m3ps2_ = 0, radius_m_ = 0;
  std::vector<double> C_, S_;  // n (n + 1) / 2 + m
};

}  // namespace orrery
