/// What the parts of the filter's implementation share; not for users.
#pragma once

#include "formation_gnc/navigation/formation_filter.hpp"

namespace formation_gnc {

constexpr int kSelf = 0, kOther = 1;
constexpr int kFewestToJudge = 4;

inline double square(double x) {
  return x * x;
}

inline int first_ambiguity(int who) {
  return who == kSelf ? kAmbiguitySelf : kAmbiguityOther;
}

inline double phase_m(const CarrierArc& arc, const Observation& o) {
  return kWavelength_m * (o.phase_cycles - arc.base_cycles);
}

// Of an epoch: the state is wrong then, not the measurements.
inline bool most_rejected(const UpdateReport& report) {
  const int tried = report.used + report.rejected;
  return tried >= kFewestToJudge && 2 * report.rejected > tried;
}

/// Of count > 0 numbers, which it sorts.
inline double median(double* x, int count) {
  for (int i = 1; i < count; ++i) {
    const double held = x[i];
    int j = i;
    for (; j > 0 && x[j - 1] > held; --j) x[j] = x[j - 1];
    x[j] = held;
  }
  return count % 2 == 1 ? x[count / 2] : 0.5 * (x[count / 2 - 1] + x[count / 2]);
}

/// What a receiver sees of satellites that are known.
struct FormationFilter::Sight {
  const Observation* observation[kChannels];
  Predicted predicted[kChannels];
  int count = 0;

  int find(int prn) const {
    int k = count - 1;
    while (k >= 0 && observation[k]->prn != prn) --k;
    return k;
  }
};

/// A scalar of sdcp_update(), and what it is made of.
struct FormationFilter::Difference {
  SparseRow h;
  double r = 0.0, innovation = 0.0;
  const Observation *self = nullptr, *other = nullptr;
  int at_self = 0, at_other = 0;  // channels
  bool rejected = false;
};
struct FormationFilter::Differences {
  int count = 0;
  Difference item[kChannels];
};

}  // namespace formation_gnc
