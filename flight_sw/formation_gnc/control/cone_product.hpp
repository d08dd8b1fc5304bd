/// The cone of a second-order cone program, and its Nesterov-Todd scaling.
///
/// K is a nonnegative orthant followed by second-order cones {(t, u): |u| <= t}. For s, z inside K,
/// the scaling is the symmetric W with W z = W^-1 s =: lambda (Nesterov & Todd 1997; formulas of
/// Vandenberghe 2010, §4): W = eta (2 v v' - J) to the power 1/2 on a second-order cone, kept as
/// eta and one unit hyperbolic vector.
#pragma once

#include <Eigen/Core>

#include <vector>

namespace formation_gnc {

class ConeProduct {
 public:
  struct Cone {
    int first, size;
  };

  ConeProduct(int orthant, const std::vector<int>& second_order);

  int rows() const { return rows_; }
  /// Of the barrier: what z's divides to give mu.
  int degree() const { return orthant_ + static_cast<int>(second_order_.size()); }
  /// Rows of the orthant are cones of size 1.
  int count() const { return degree(); }
  Cone cone(int index) const {
    if (index < orthant_) return {index, 1};
    return second_order_[static_cast<std::size_t>(index - orthant_)];
  }

  void set_identity(Eigen::VectorXd* e) const;
  /// a = u o v, the Jordan product; may be one of both.
  void product(const Eigen::VectorXd& u, const Eigen::VectorXd& v, Eigen::VectorXd* a) const;
  /// d = lambda \ d: the d' with lambda o d' = d.
  void divide(const Eigen::VectorXd& lambda, Eigen::VectorXd* d) const;
  /// By how many times e the point must be shifted to reach the border of K: negative inside.
  double distance_outside(const Eigen::VectorXd& s) const;
  void shift(double by, Eigen::VectorXd* s) const;
  /// Largest step with lambda + step d in K, at most `limit`; lambda inside K.
  double largest_step(const Eigen::VectorXd& lambda, const Eigen::VectorXd& d, double limit) const;

 private:
  int orthant_, rows_;
  std::vector<Cone> second_order_;
};

/// W, for a pair of points.
class NesterovTodd {
 public:
  explicit NesterovTodd(const ConeProduct& cones);

  void set_identity();
  /// @return false if s or z is not inside K.
  bool update(const Eigen::VectorXd& s, const Eigen::VectorXd& z);

  /// v = W v and v = W^-1 v, whole.
  void apply(Eigen::VectorXd* v) const;
  void apply_inverse(Eigen::VectorXd* v) const;
  /// The rows of one cone: `v` points to its `cone.size` values.
  void apply_inverse(int cone_index, double* v) const;

 private:
  void apply_cone(int index, bool inverse, double* v) const;

  const ConeProduct& cones_;
  Eigen::VectorXd w_;    // unit hyperbolic vector of each cone; 1 in the orthant
  Eigen::VectorXd eta_;  // of each cone
};

}  // namespace formation_gnc
