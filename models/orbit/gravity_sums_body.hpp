// Included once by each gravity_sums_*.cpp, which are compiled for different processors. Everything
// here has internal linkage and no header with inline functions is included: a copy compiled for
// AVX must never be the one that the linker keeps for all.
#include <orrery/models/orbit/gravity_sums.hpp>

#include <cstring>

namespace orrery::gravity_sums {
namespace {

template <int kWidth>
struct VectorOf {
  typedef double type __attribute__((vector_size(kWidth * sizeof(double))));
};
template <int kWidth>
using Vector = typename VectorOf<kWidth>::type;

template <int kWidth>
[[gnu::always_inline]] inline Vector<kWidth> load(const double* lanes) {
  Vector<kWidth> v;
  std::memcpy(&v, lanes, sizeof v);
  return v;
}

template <int kWidth>
[[gnu::always_inline]] inline void store(double* lanes, Vector<kWidth> v) {
  std::memcpy(lanes, &v, sizeof v);
}

template <int kWidth>
[[gnu::always_inline]] inline Vector<kWidth> all(double value) {
  return value + Vector<kWidth>{};
}

// Coefficients of eight orders or some of them. Where two points use them, they stay in a register:
// g++ would load them twice.
template <int kWidth, int kPoints>
[[gnu::always_inline]] inline Vector<kWidth> coefficients(const double* lanes) {
  Vector<kWidth> v = load<kWidth>(lanes);
#if defined(__x86_64__)
  if constexpr (kPoints > 1) asm("" : "+v"(v));
#endif
  return v;
}

// One point's recursion, and its sums over coefficients of the order below, the same, the one
// above.
template <int kWidth>
struct Column {
  Vector<kWidth> z2, rho2;
  Vector<kWidth> b, f;  // b_k of the even row; b_(k+1) = z f of the odd one
  struct Sums {
    Vector<kWidth> below, same, above;
  } even_C, even_S, odd_C, odd_S;

  [[gnu::always_inline]] explicit Column(const Point& at)
      : z2(all<kWidth>(at.z * at.z)),
        rho2(all<kWidth>(at.rho2)),
        b(all<kWidth>(1)),
        f(all<kWidth>(1)),
        even_C{},
        even_S{},
        odd_C{},
        odd_S{} {}

  // The gradient's share of these orders, and the powers of the next block's.
  [[gnu::always_inline]] void finish(Point& at, int lane, Vector<kWidth> weight_below) const {
    const Vector<kWidth> z = all<kWidth>(at.z);
    const Vector<kWidth> C_below = weight_below * (even_C.below + z * odd_C.below);
    const Vector<kWidth> S_below = weight_below * (even_S.below + z * odd_S.below);
    const Vector<kWidth> C = even_C.same + z * odd_C.same, S = even_S.same + z * odd_S.same;
    const Vector<kWidth> C_above = even_C.above + z * odd_C.above;
    const Vector<kWidth> S_above = even_S.above + z * odd_S.above;
    const Vector<kWidth> re = load<kWidth>(at.re + lane), im = load<kWidth>(at.im + lane);
    store<kWidth>(at.a_x + lane, load<kWidth>(at.a_x + lane) +
                                     (re * (C_above - C_below) + im * (S_above - S_below)));
    store<kWidth>(at.a_y + lane, load<kWidth>(at.a_y + lane) +
                                     (re * (S_above + S_below) - im * (C_above + C_below)));
    store<kWidth>(at.a_z + lane, load<kWidth>(at.a_z + lane) - (re * C + im * S));
    store<kWidth>(at.re + lane, re * at.step_re - im * at.step_im);
    store<kWidth>(at.im + lane, re * at.step_im + im * at.step_re);
  }
};

// Both rows of a pair for one point or several. The statements stand in an order in which one
// point's sums, b and f and two more fit into sixteen registers; the compilers keep it.
template <int kWidth, class... Columns>
[[gnu::always_inline]] inline void sum_pair(const RowPair& row, int lane, Columns&... at) {
  constexpr int kPoints = sizeof...(Columns);
  const auto from = [lane](const double* lanes) __attribute__((always_inline)) {
    return coefficients<kWidth, kPoints>(lanes + lane);
  };
  const double *C = row.C[0], *S = row.S[0];
  Vector<kWidth> t = from(C);
  ((at.even_C.below += at.b * t), ...);
  t = from(S);
  ((at.even_S.below += at.b * t), ...);
  t = from(row.gamma[0]);
  ((at.b *= t * at.rho2, at.b = at.z2 * at.f - at.b), ...);
  t = from(C + 1);
  ((at.odd_C.same += at.f * t), ...);
  t = from(S + 1);
  ((at.odd_S.same += at.f * t), ...);
  t = from(C + 2);
  ((at.even_C.above += at.b * t), ...);
  t = from(S + 2);
  ((at.even_S.above += at.b * t), ...);

  C = row.C[1], S = row.S[1];
  t = from(C);
  ((at.odd_C.below += at.f * t), ...);
  t = from(S);
  ((at.odd_S.below += at.f * t), ...);
  t = from(row.gamma[1]);
  ((at.f *= t * at.rho2, at.f = at.b - at.f), ...);
  t = from(C + 1);
  ((at.even_C.same += at.b * t), ...);
  t = from(S + 1);
  ((at.even_S.same += at.b * t), ...);
  t = from(C + 2);
  ((at.odd_C.above += at.f * t), ...);
  t = from(S + 2);
  ((at.odd_S.above += at.f * t), ...);
}

// The derivative across the axis of a zonal term is whole where that of others is halved.
constexpr double kWeightBelow[2][kLanes] = {{1, 2, 1, 1, 1, 1, 1, 1}, {1, 1, 1, 1, 1, 1, 1, 1}};

// Narrow vectors end where their own orders do: there is nothing but zeros beyond, and a sum that
// began at +0 keeps its bits when a zero of either sign is added.
template <int kWidth, class SumOrders>
[[gnu::always_inline]] inline void for_all_orders(const Series& series, SumOrders sum) {
  const RowPair* row = series.pairs;
  for (int block = 0; block < block_count(series); ++block) {
    const int first = block * kLanes;
    const double* weight_below = kWeightBelow[block == 0 ? 0 : 1];
    for (int lane = 0; lane < kLanes; lane += kWidth)
      sum(row, pairs_from(series, first + lane), lane, load<kWidth>(weight_below + lane));
    row += pairs_from(series, first);
  }
}

template <int kWidth>
[[gnu::always_inline]] inline void sum_one(const Series& series, Point& point) {
  for_all_orders<kWidth>(
      series, [&](const RowPair* row, int pairs, int lane, Vector<kWidth> weight_below)
                  __attribute__((always_inline)) {
                    Column<kWidth> column(point);
                    for (int i = 0; i < pairs; ++i) sum_pair<kWidth>(row[i], lane, column);
                    column.finish(point, lane, weight_below);
                  });
}

template <int kWidth>
[[gnu::always_inline]] inline void sum_two(const Series& series, Point& first, Point& second) {
  for_all_orders<kWidth>(
      series, [&](const RowPair* row, int pairs, int lane, Vector<kWidth> weight_below)
                  __attribute__((always_inline)) {
                    Column<kWidth> a(first), b(second);
                    for (int i = 0; i < pairs; ++i) sum_pair<kWidth>(row[i], lane, a, b);
                    a.finish(first, lane, weight_below);
                    b.finish(second, lane, weight_below);
                  });
}

}  // namespace
}  // namespace orrery::gravity_sums
