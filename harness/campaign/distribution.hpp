/// How a model parameter is dispersed from run to run.
#pragma once

#include <orrery/harness/kernel/random.hpp>

#include <string>
#include <variant>
#include <vector>

namespace orrery {

struct Normal {
  double mean = 0, sigma = 1;  // sigma >= 0
};
struct Uniform {
  double low = 0, high = 1;  // low <= high
};
/// exp of a normal: half of the values lie below `median`, 68 % within a factor exp(sigma) of it.
struct LogNormal {
  double median = 1;  // above 0
  double sigma = 1;   // of the natural logarithm, >= 0
};
/// A normal, given that it lies in [low, high].
struct TruncatedNormal {
  double mean = 0, sigma = 1;  // sigma > 0
  double low = -1, high = 1;   // low < high, not more than 8 sigma from the mean on the near side
};
/// One of these values; with equal probability, or in proportion to `weights`.
struct Discrete {
  std::vector<double> values = {};
  std::vector<double> weights = {};  // none, or one for each value, >= 0 and not all 0
};

/// Any of them. One draw of the stream per value, so that what is drawn after it does not move when
/// a parameter of it changes.
class Distribution {
 public:
  using Any = std::variant<Normal, Uniform, LogNormal, TruncatedNormal, Discrete>;

  /// @throws std::invalid_argument  a parameter that is not finite or outside its range.
  Distribution(const Normal& normal);
  Distribution(const Uniform& uniform);
  Distribution(const LogNormal& log_normal);
  Distribution(const TruncatedNormal& truncated);
  Distribution(const Discrete& discrete);

  double draw(RandomStream& stream) const { return at(stream.uniform()); }
  /// The value below which a fraction `p` of all lie (Discrete: at most a fraction p).
  /// @param p  In (0, 1).
  double at(double p) const;
  /// "Normal(11, 0.11)", "Discrete(1, 2, 5; weights 1, 1, 2)": what records and reports show.
  std::string to_string() const;
  const Any& get() const { return any_; }

 private:
  Any any_;
};

}  // namespace orrery
