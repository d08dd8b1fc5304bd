// Included once by each ud_kernel_*.cpp, which are compiled for different processors. Everything
// here has internal linkage and no header with inline functions is included: a copy compiled for
// AVX2 must never be the one that the linker keeps for all.
#include "formation_gnc/navigation/ud_kernel.hpp"

namespace formation_gnc {
namespace ud_kernel {
namespace {

constexpr int kMostStates = 64;

// Aligned as doubles are: flight heaps of 8-byte alignment must do.
template <int kWidth>
struct Lanes;
template <>
struct Lanes<2> {
  typedef double Vector __attribute__((vector_size(16), aligned(8), may_alias));
};
template <>
struct Lanes<4> {
  typedef double Vector __attribute__((vector_size(32), aligned(8), may_alias));
};

template <int kWidth>
struct Kernel {
  typedef typename Lanes<kWidth>::Vector Vector;
  static constexpr int kParts = kLanes / kWidth;  // registers that make four lanes

  static const Vector* at(const double* x) { return reinterpret_cast<const Vector*>(x); }
  static Vector* at(double* x) { return reinterpret_cast<Vector*>(x); }

  static double sum(const Vector* lanes) {
    double of[kLanes];
    for (int p = 0; p < kParts; ++p) *at(of + p * kWidth) = lanes[p];
    return (of[0] + of[1]) + (of[2] + of[3]);
  }

  // Four columns of a block, and what each number of theirs goes through in the loops, written out:
  // a compiler would keep arrays of registers in memory.
  struct Products {
    Vector s0 = {}, s1 = {}, s2 = {}, s3 = {};

    [[gnu::always_inline]] void add(const double* u, int length, const double* h) {
      const Vector x = *at(h);
      s0 += x * *at(u);
      s1 += x * *at(u + length);
      s2 += x * *at(u + 2 * length);
      s3 += x * *at(u + 3 * length);
    }
  };

  struct Factors {
    Vector lambda0, v0, lambda1, v1, lambda2, v2, lambda3, v3;

    [[gnu::always_inline]] void apply(double* u, int length, double* b) const {
      const Vector x0 = *at(b), u0 = *at(u);
      *at(u) = u0 + lambda0 * x0;
      const Vector x1 = x0 + v0 * u0, u1 = *at(u + length);
      *at(u + length) = u1 + lambda1 * x1;
      const Vector x2 = x1 + v1 * u1, u2 = *at(u + 2 * length);
      *at(u + 2 * length) = u2 + lambda2 * x2;
      const Vector x3 = x2 + v2 * u2, u3 = *at(u + 3 * length);
      *at(u + 3 * length) = u3 + lambda3 * x3;
      *at(b) = x3 + v3 * u3;
    }
  };

  // Of each column, over its lanes.
  [[gnu::always_inline]] static void sums(const Products& low, const Products& high, double* of) {
    if constexpr (kWidth == kLanes) {
      (void)high;
      const Vector s01 = __builtin_shufflevector(low.s0, low.s1, 0, 4, 2, 6) +
                         __builtin_shufflevector(low.s0, low.s1, 1, 5, 3, 7);
      const Vector s23 = __builtin_shufflevector(low.s2, low.s3, 0, 4, 2, 6) +
                         __builtin_shufflevector(low.s2, low.s3, 1, 5, 3, 7);
      *at(of) = __builtin_shufflevector(s01, s23, 0, 1, 4, 5) +
                __builtin_shufflevector(s01, s23, 2, 3, 6, 7);
    } else {
      of[0] = (low.s0[0] + low.s0[1]) + (high.s0[0] + high.s0[1]);
      of[1] = (low.s1[0] + low.s1[1]) + (high.s1[0] + high.s1[1]);
      of[2] = (low.s2[0] + low.s2[1]) + (high.s2[0] + high.s2[1]);
      of[3] = (low.s3[0] + low.s3[1]) + (high.s3[0] + high.s3[1]);
    }
  }

  static double project(int states, const double* U, const double* D, const Row& h, double* f) {
    // By fours: where h is not zero.
    double part[kMostStates];
    int place[kMostStates / kLanes], count = 0;
    for (int k = 0; k < h.count; ++k) {
      const int p = h.state[k] - h.state[k] % kLanes;
      if (count == 0 || place[count - 1] != p) {
        for (int i = 0; i < kLanes; i += kWidth) *at(part + kLanes * count + i) = Vector{};
        place[count++] = p;
      }
      part[kLanes * (count - 1) + h.state[k] % kLanes] = h.value[k];
    }
    for (int j = 0; j < place[0]; ++j) f[j] = 0.0;
    Vector variance[kParts] = {};
    int reached = 0;  // parts that this block's columns reach
    for (int j = place[0]; j < states; j += kLanes) {
      if (reached < count && place[reached] == j) ++reached;
      const double* column = U + offset(j);
      const int length = rows(j);
      Products low, high;
      for (int k = 0; k < reached; ++k) {
        low.add(column + place[k], length, part + kLanes * k);
        if (kParts == 2) {
          high.add(column + place[k] + kWidth, length, part + kLanes * k + kWidth);
        }
      }
      sums(low, high, f + j);
      for (int p = 0; p < kParts; ++p) {
        const Vector x = at(f + j)[p];
        variance[p] += x * x * at(D + j)[p];
      }
    }
    return sum(variance);
  }

  static double measure(int states, double* U, double* D, const double* f, double r, double* b) {
    double alpha = r, inverse = 1.0 / r;
    for (int j = 0; j < states; j += kLanes) {
      double lambda[kLanes], v[kLanes];
      for (int c = 0; c < kLanes; ++c) {
        const double before = alpha;
        lambda[c] = -f[j + c] * inverse;
        v[c] = D[j + c] * f[j + c];
        alpha = before + f[j + c] * v[c];
        inverse = 1.0 / alpha;
        D[j + c] *= before * inverse;
      }
      const Vector zero = {};
      const Factors factors = {zero + lambda[0], zero + v[0], zero + lambda[1], zero + v[1],
                               zero + lambda[2], zero + v[2], zero + lambda[3], zero + v[3]};
      for (int p = 0; p < kParts; ++p) at(b + j)[p] = zero;
      const int length = rows(j);
      double* column = U + offset(j);
      for (int i = 0; i < length; i += kWidth) factors.apply(column + i, length, b + i);
    }
    return inverse;
  }

  static void add(double* U, double* D, double w, double* x, int last) {
    for (int j = last; j >= 0 && w > 0.0; --j) {
      const double s = x[j];
      if (s == 0.0) continue;
      const double d = D[j] + w * s * s;
      const double share = w * s / d;
      w *= D[j] / d;
      D[j] = d;
      double* column = U + offset(j);
      for (int i = 0; i < rows(j); i += kWidth) {
        const Vector rest = *at(x + i) - s * *at(column + i);
        *at(x + i) = rest;
        *at(column + i) += share * rest;
      }
    }
  }

  static void refactor(double* U, double* D, int first, Weighted* w) {
    double weighted[kWide];
    for (int k = kRows - 1; k >= 0; --k) {
      const int count = k >= kUpper ? kHalf : kWide;
      const double* row = w->row[k];
      Vector squares[kParts] = {};
      for (int i = 0; i < count; i += kLanes) {
        for (int p = 0; p < kParts; ++p) {
          const Vector x = at(row + i)[p];
          at(weighted + i)[p] = at(w->weight + i)[p] * x;
          squares[p] += at(weighted + i)[p] * x;
        }
      }
      const double total = sum(squares);
      const double d = total > kLeastWeight ? total : kLeastWeight;
      D[first + k] = d;
      double* column = U + offset(first + k) + first;
      for (int j = 0; j < k; ++j) {
        double* other = w->row[j];
        Vector products[kParts] = {};
        for (int i = 0; i < count; i += kLanes) {
          for (int p = 0; p < kParts; ++p) products[p] += at(weighted + i)[p] * at(other + i)[p];
        }
        const double u = sum(products) / d;
        for (int i = 0; i < count; i += kWidth) *at(other + i) -= u * *at(row + i);
        column[j] = u;
      }
    }
  }
};

template <int kWidth>
constexpr Loops loops() {
  return {Kernel<kWidth>::project, Kernel<kWidth>::measure, Kernel<kWidth>::add,
          Kernel<kWidth>::refactor};
}

}  // namespace
}  // namespace ud_kernel
}  // namespace formation_gnc
