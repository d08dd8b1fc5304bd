/// Small matrices of fixed size: plain values on the stack, no allocation, no dependency.
///
/// Row-major. A Vector<N> is an N x 1 matrix that also takes one index. Indices are not checked:
/// sizes are types, so a wrong shape does not compile.
#pragma once

#include <cmath>

namespace flight_support {

template <int R, int C>
struct Matrix {
  static_assert(R > 0 && C > 0, "a matrix has at least one row and one column");
  double cell[R][C] = {};

  constexpr double& operator()(int row, int column) { return cell[row][column]; }
  constexpr double operator()(int row, int column) const { return cell[row][column]; }
  constexpr double& operator[](int row) {
    static_assert(C == 1, "one index is for vectors");
    return cell[row][0];
  }
  constexpr double operator[](int row) const {
    static_assert(C == 1, "one index is for vectors");
    return cell[row][0];
  }
};

template <int N>
using Vector = Matrix<N, 1>;
using Vec3 = Vector<3>;
using Mat3 = Matrix<3, 3>;

constexpr Vec3 vec3(double x, double y, double z) {
  Vec3 v;
  v[0] = x;
  v[1] = y;
  v[2] = z;
  return v;
}

template <int R, int C>
constexpr Matrix<R, C> operator+(Matrix<R, C> a, const Matrix<R, C>& b) {
  for (int r = 0; r < R; ++r) {
    for (int c = 0; c < C; ++c) a(r, c) += b(r, c);
  }
  return a;
}

template <int R, int C>
constexpr Matrix<R, C> operator-(Matrix<R, C> a, const Matrix<R, C>& b) {
  for (int r = 0; r < R; ++r) {
    for (int c = 0; c < C; ++c) a(r, c) -= b(r, c);
  }
  return a;
}

template <int R, int C>
constexpr Matrix<R, C> operator*(double s, Matrix<R, C> a) {
  for (int r = 0; r < R; ++r) {
    for (int c = 0; c < C; ++c) a(r, c) *= s;
  }
  return a;
}

template <int R, int K, int C>
constexpr Matrix<R, C> operator*(const Matrix<R, K>& a, const Matrix<K, C>& b) {
  Matrix<R, C> product;
  for (int r = 0; r < R; ++r) {
    for (int c = 0; c < C; ++c) {
      double sum = 0.0;
      for (int k = 0; k < K; ++k) sum += a(r, k) * b(k, c);
      product(r, c) = sum;
    }
  }
  return product;
}

template <int R, int C>
constexpr Matrix<C, R> transpose(const Matrix<R, C>& a) {
  Matrix<C, R> t;
  for (int r = 0; r < R; ++r) {
    for (int c = 0; c < C; ++c) t(c, r) = a(r, c);
  }
  return t;
}

template <int N>
constexpr Matrix<N, N> identity() {
  Matrix<N, N> one;
  for (int k = 0; k < N; ++k) one(k, k) = 1.0;
  return one;
}

template <int N>
constexpr Matrix<N, N> diagonal(const Vector<N>& d) {
  Matrix<N, N> m;
  for (int k = 0; k < N; ++k) m(k, k) = d[k];
  return m;
}

template <int N>
constexpr double dot(const Vector<N>& a, const Vector<N>& b) {
  double sum = 0.0;
  for (int k = 0; k < N; ++k) sum += a[k] * b[k];
  return sum;
}

template <int N>
double norm(const Vector<N>& a) {
  return std::sqrt(dot(a, a));
}

constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
  return vec3(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
}

template <int R, int C>
bool is_finite(const Matrix<R, C>& a) {
  for (int r = 0; r < R; ++r) {
    for (int c = 0; c < C; ++c) {
      if (!std::isfinite(a(r, c))) return false;
    }
  }
  return true;
}

/// (a + a^T) / 2: removes the rounding that lets a covariance drift away from symmetry.
template <int N>
constexpr Matrix<N, N> symmetric(const Matrix<N, N>& a) {
  Matrix<N, N> s;
  for (int r = 0; r < N; ++r) {
    for (int c = 0; c < N; ++c) s(r, c) = 0.5 * (a(r, c) + a(c, r));
  }
  return s;
}

/// Solves a * x = b by elimination with partial pivoting, for C right-hand sides.
/// @return false, and x untouched, if a pivot is not above 1e-14 of the largest cell of `a`.
template <int N, int C>
bool solve(Matrix<N, N> a, Matrix<N, C> b, Matrix<N, C>* x) {
  double largest = 0.0;
  for (int r = 0; r < N; ++r) {
    for (int c = 0; c < N; ++c) largest = std::fmax(largest, std::fabs(a(r, c)));
  }
  for (int k = 0; k < N; ++k) {
    int pivot = k;
    for (int r = k + 1; r < N; ++r) {
      if (std::fabs(a(r, k)) > std::fabs(a(pivot, k))) pivot = r;
    }
    // Written so that a NaN fails too.
    if (!(std::fabs(a(pivot, k)) > 1e-14 * largest)) return false;
    for (int c = 0; c < N; ++c) {
      const double held = a(k, c);
      a(k, c) = a(pivot, c);
      a(pivot, c) = held;
    }
    for (int c = 0; c < C; ++c) {
      const double held = b(k, c);
      b(k, c) = b(pivot, c);
      b(pivot, c) = held;
    }
    for (int r = k + 1; r < N; ++r) {
      const double factor = a(r, k) / a(k, k);
      for (int c = k; c < N; ++c) a(r, c) -= factor * a(k, c);
      for (int c = 0; c < C; ++c) b(r, c) -= factor * b(k, c);
    }
  }
  for (int c = 0; c < C; ++c) {
    for (int r = N - 1; r >= 0; --r) {
      double sum = b(r, c);
      for (int k = r + 1; k < N; ++k) sum -= a(r, k) * b(k, c);
      b(r, c) = sum / a(r, r);
    }
  }
  *x = b;
  return true;
}

}  // namespace flight_support
