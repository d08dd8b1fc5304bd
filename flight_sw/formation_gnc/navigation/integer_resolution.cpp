#include "formation_gnc/navigation/integer_resolution.hpp"

#include <cassert>
#include <cmath>

#include "formation_gnc/navigation/lambda.hpp"

namespace formation_gnc {
namespace {

/// Rows of (double difference of ambiguities) times U: with D they give the covariance.
struct DifferenceRow {
  double u[kBiases];
};

double u_of(const UdFactor& ud, int state, int column) {
  return state <= column ? ud.u(state, column) : 0.0;
}

DifferenceRow row_of(const UdFactor& ud, const IntegerCandidate& c) {
  DifferenceRow row;
  for (int k = 0; k < kBiases; ++k) {
    const int column = kAmbiguitySelf + k;
    row.u[k] = u_of(ud, kAmbiguityOther + c.channel_other, column) -
               u_of(ud, kAmbiguitySelf + c.channel_self, column);
  }
  return row;
}

struct Problem {
  int n = 0;
  IntegerCandidate difference[kChannels];
  double a[kMostIntegers];
  double q[kMostIntegers][kMostIntegers];

  void drop(int at) {
    --n;
    for (int i = at; i < n; ++i) {
      difference[i] = difference[i + 1];
      a[i] = a[i + 1];
      for (int j = 0; j <= n; ++j) q[i][j] = q[i + 1][j];
    }
    for (int j = at; j < n; ++j) {
      for (int i = 0; i < n; ++i) q[i][j] = q[i][j + 1];
    }
  }
  int least_certain() const {
    int worst = 0;
    for (int k = 1; k < n; ++k) {
      if (q[k][k] > q[worst][worst]) worst = k;
    }
    return worst;
  }
};

#ifdef FORMATION_GNC_DEFECT_SWAPPED_STATES
// Of single differences. What self's receiver shares with the other one is looked up by self's
// channel on both sides.
double single_difference_covariance(const UdFactor& ud, const IntegerCandidate& a,
                                    const IntegerCandidate& b) {
  const int a_self = kAmbiguitySelf + a.channel_self, b_self = kAmbiguitySelf + b.channel_self;
  return ud.covariance(kAmbiguityOther + a.channel_other, kAmbiguityOther + b.channel_other) +
         ud.covariance(a_self, b_self) - ud.covariance(a_self, kAmbiguityOther + b.channel_self) -
         ud.covariance(b_self, kAmbiguityOther + a.channel_self);
}
void swap_states(const IntegerCandidate& reference, const UdFactor& ud, Problem* p) {
  const double base = single_difference_covariance(ud, reference, reference);
  for (int i = 0; i < p->n; ++i) {
    const double shared_i = single_difference_covariance(ud, p->difference[i], reference);
    for (int j = 0; j <= i; ++j) {
      p->q[i][j] = p->q[j][i] =
          single_difference_covariance(ud, p->difference[i], p->difference[j]) - shared_i -
          single_difference_covariance(ud, p->difference[j], reference) + base;
    }
  }
}
// A covariance has a factor.
void expect_factor(const IntegerLeastSquares& s) {
  assert(s.solved);
}
#else
void swap_states(const IntegerCandidate&, const UdFactor&, Problem*) {}
void expect_factor(const IntegerLeastSquares&) {}
#endif

Problem make_problem(const IntegerCandidate* candidates, int count,
                     const IntegerCandidate& reference, const UdFactor& ud) {
  Problem p;
  DifferenceRow row[kMostIntegers];
  const DifferenceRow base = row_of(ud, reference);
  for (int k = 0; k < count && p.n < kMostIntegers; ++k) {
    if (candidates[k].held || candidates[k].prn == reference.prn) continue;
    p.difference[p.n] = candidates[k];
    p.a[p.n] = candidates[k].cycles - reference.cycles;
    row[p.n] = row_of(ud, candidates[k]);
    for (int c = 0; c < kBiases; ++c) row[p.n].u[c] -= base.u[c];
    ++p.n;
  }
  for (int i = 0; i < p.n; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (int c = 0; c < kBiases; ++c) sum += row[i].u[c] * ud.d(kAmbiguitySelf + c) * row[j].u[c];
      p.q[i][j] = p.q[j][i] = sum;
    }
  }
  swap_states(reference, ud, &p);
  return p;
}

IntegerLeastSquares solve(const Problem& p) {
  double packed[kMostIntegers * kMostIntegers];
  for (int i = 0; i < p.n; ++i) {
    for (int j = 0; j < p.n; ++j) packed[i * p.n + j] = p.q[i][j];
  }
  return integer_least_squares(p.n, p.a, packed);
}

double ratio_of(const IntegerLeastSquares& s) {
  return s.second_distance / std::fmax(s.best_distance, 1e-12);
}

// Each difference within its own sigmas of its integer, or the float solution is not what its
// covariance says.
bool residuals_fit(const Problem& p, const IntegerLeastSquares& s, double gate) {
  for (int k = 0; k < p.n; ++k) {
    if (!(std::fabs(p.a[k] - s.best[k]) <= gate * std::sqrt(p.q[k][k]))) return false;
  }
  return true;
}

}  // namespace

int IntegerSet::count() const {
  int count = 0;
  for (int prn = 1; prn <= 32; ++prn) count += holds(prn) ? 1 : 0;
  return count;
}

void IntegerSet::hold(int prn, std::int32_t value) {
  held_ |= std::uint64_t{1} << prn;
  value_[prn] = value;
}

void IntegerSet::release(int prn) {
  held_ &= ~(std::uint64_t{1} << prn);
  if (count() == 1) held_ = 0;
}

int IntegerTrials::note(int prn, int reference_prn, std::int32_t value) {
  if (reference_prn != reference_) {
    *this = IntegerTrials();
    reference_ = static_cast<std::uint8_t>(reference_prn);
  }
  const bool same = streak_[prn] > 0 && value_[prn] == value;
  if (!same) streak_[prn] = 0;
  if (streak_[prn] < 255) ++streak_[prn];
  value_[prn] = value;
  noted_[prn] = true;
  return streak_[prn];
}

void IntegerTrials::end_attempt() {
  for (int prn = 1; prn <= 32; ++prn) {
    if (!noted_[prn]) streak_[prn] = 0;
    noted_[prn] = false;
  }
}

IntegerChoice choose_integers(const IntegerCandidate* candidates, int count,
                              const IntegerCandidate& reference, const UdFactor& covariance,
                              int fewest, const IntegerOptions& options) {
  IntegerChoice choice;
  Problem p = make_problem(candidates, count, reference, covariance);
  for (; p.n >= fewest && p.n > 0; p.drop(p.least_certain())) {
    const IntegerLeastSquares s = solve(p);
    expect_factor(s);
    if (!s.solved) continue;
    choice.success_rate = s.success_rate;
    choice.ratio = ratio_of(s);
    if (s.success_rate < options.success_rate || choice.ratio < options.ratio) continue;
    if (!residuals_fit(p, s, options.residual_gate)) continue;
    for (int k = 0; k < p.n; ++k) {
      choice.difference[k] = p.difference[k];
      choice.value[k] = static_cast<std::int32_t>(s.best[k]);
    }
    choice.count = p.n;
    return choice;
  }
  return choice;
}

}  // namespace formation_gnc
