#include "formation_gnc/control/cone_product.hpp"

#include <cmath>

namespace formation_gnc {
namespace {

double tail_dot(const double* a, const double* b, int size) {
  double sum = 0.0;
  for (int k = 1; k < size; ++k) sum += a[k] * b[k];
  return sum;
}

// t^2 - |u|^2 without cancellation of the squares.
double determinant(const double* v, int size) {
  const double u = std::sqrt(tail_dot(v, v, size));
  return (v[0] - u) * (v[0] + u);
}

}  // namespace

ConeProduct::ConeProduct(int orthant, const std::vector<int>& second_order)
    : orthant_(orthant), rows_(orthant) {
  second_order_.reserve(second_order.size());
  for (const int size : second_order) {
    second_order_.push_back({rows_, size});
    rows_ += size;
  }
}

void ConeProduct::set_identity(Eigen::VectorXd* e) const {
  e->setZero(rows_);
  for (int k = 0; k < count(); ++k) (*e)[cone(k).first] = 1.0;
}

void ConeProduct::product(const Eigen::VectorXd& u, const Eigen::VectorXd& v,
                          Eigen::VectorXd* a) const {
  for (int index = 0; index < count(); ++index) {
    const Cone at = cone(index);
    const double* p = u.data() + at.first;
    const double* q = v.data() + at.first;
    double* out = a->data() + at.first;
    const double p0 = p[0], q0 = q[0];
    const double head = p0 * q0 + tail_dot(p, q, at.size);
    for (int k = 1; k < at.size; ++k) out[k] = p0 * q[k] + q0 * p[k];
    out[0] = head;
  }
}

void ConeProduct::divide(const Eigen::VectorXd& lambda, Eigen::VectorXd* d) const {
  for (int index = 0; index < count(); ++index) {
    const Cone at = cone(index);
    const double* l = lambda.data() + at.first;
    double* x = d->data() + at.first;
    x[0] = (l[0] * x[0] - tail_dot(l, x, at.size)) / determinant(l, at.size);
    for (int k = 1; k < at.size; ++k) x[k] = (x[k] - x[0] * l[k]) / l[0];
  }
}

double ConeProduct::distance_outside(const Eigen::VectorXd& s) const {
  double furthest = -INFINITY;
  for (int index = 0; index < count(); ++index) {
    const Cone at = cone(index);
    const double* v = s.data() + at.first;
    furthest = std::fmax(furthest, std::sqrt(tail_dot(v, v, at.size)) - v[0]);
  }
  return furthest;
}

void ConeProduct::shift(double by, Eigen::VectorXd* s) const {
  for (int index = 0; index < count(); ++index) (*s)[cone(index).first] += by;
}

// The automorphism that takes lambda to a multiple of e takes d to rho; |rho_1| - rho_0 is then the
// inverse of the step: Vandenberghe (2010), §7.
double ConeProduct::largest_step(const Eigen::VectorXd& lambda, const Eigen::VectorXd& d,
                                 double limit) const {
  double inverse = 1.0 / limit;
  for (int index = 0; index < count(); ++index) {
    const Cone at = cone(index);
    const double* l = lambda.data() + at.first;
    const double* x = d.data() + at.first;
    const double root = std::sqrt(determinant(l, at.size));
    const double l0 = l[0] / root;
    const double rho0 = (l[0] * x[0] - tail_dot(l, x, at.size)) / root;
    const double factor = (rho0 + x[0]) / (l0 + 1.0) / root;
    double rho2 = 0.0;
    for (int k = 1; k < at.size; ++k) {
      const double rho = x[k] - factor * l[k];
      rho2 += rho * rho;
    }
    inverse = std::fmax(inverse, (std::sqrt(rho2) - rho0) / root);
  }
  return 1.0 / inverse;
}

NesterovTodd::NesterovTodd(const ConeProduct& cones) : cones_(cones) {
  set_identity();
}

void NesterovTodd::set_identity() {
  cones_.set_identity(&w_);
  eta_.setOnes(cones_.count());
}

bool NesterovTodd::update(const Eigen::VectorXd& s, const Eigen::VectorXd& z) {
  for (int index = 0; index < cones_.count(); ++index) {
    const ConeProduct::Cone at = cones_.cone(index);
    const double* a = s.data() + at.first;
    const double* b = z.data() + at.first;
    const double det_s = determinant(a, at.size), det_z = determinant(b, at.size);
    if (!(a[0] > 0.0 && b[0] > 0.0 && det_s > 0.0 && det_z > 0.0)) return false;
    const double root_s = std::sqrt(det_s), root_z = std::sqrt(det_z);
    const double product = (a[0] * b[0] + tail_dot(a, b, at.size)) / (root_s * root_z);
    const double gamma2 = std::sqrt(2.0 + 2.0 * product);  // 2 gamma
    double* w = w_.data() + at.first;
    for (int k = 1; k < at.size; ++k) w[k] = (a[k] / root_s - b[k] / root_z) / gamma2;
    // The head from the tail, so that w is hyperbolic to rounding.
    w[0] = std::sqrt(1.0 + tail_dot(w, w, at.size));
    eta_[index] = std::sqrt(root_s / root_z);
  }
  return true;
}

void NesterovTodd::apply_cone(int index, bool inverse, double* v) const {
  const int size = cones_.cone(index).size;
  const double* w = w_.data() + cones_.cone(index).first;
  const double eta = inverse ? 1.0 / eta_[index] : eta_[index];
  const double sign = inverse ? -1.0 : 1.0;
  const double v0 = v[0], along = tail_dot(w, v, size);
  const double factor = sign * v0 + along / (1.0 + w[0]);
  v[0] = eta * (w[0] * v0 + sign * along);
  for (int k = 1; k < size; ++k) v[k] = eta * (v[k] + factor * w[k]);
}

void NesterovTodd::apply(Eigen::VectorXd* v) const {
  for (int k = 0; k < cones_.count(); ++k) apply_cone(k, false, v->data() + cones_.cone(k).first);
}

void NesterovTodd::apply_inverse(Eigen::VectorXd* v) const {
  for (int k = 0; k < cones_.count(); ++k) apply_cone(k, true, v->data() + cones_.cone(k).first);
}

void NesterovTodd::apply_inverse(int cone_index, double* v) const {
  apply_cone(cone_index, true, v);
}

}  // namespace formation_gnc
