// core/rbf/solver.h - the dense system of a growing set of centres (internal to rbf).
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/base/vec3.h"

namespace spinaltap::rbf {

/// Solves  (D - |c_i - c_j| + ridge) w + P c = f,  P^T w = 0  for a set of centres that only grows.
///
/// -|x - y| is conditionally positive definite of order one, and adding a constant D larger than the diameter of a ball
/// around the points makes it positive definite outright (D drops out of the solution since the weights sum to 0). So a
/// Cholesky factor exists, and it can be *extended* by rows when centres are added: all refits of the greedy selection
/// together cost little more than the last one alone.
class GrowingSolver {
 public:
  /// @param span_mm the diameter of a ball that will hold every centre; positions are relative to its middle.
  GrowingSolver(double span_mm, double ridge_mm, std::size_t max_centres);

  /// @pre every position is new. @error Degenerate when the enlarged matrix is not positive definite in double.
  [[nodiscard]] Result<void> add(std::span<const Vec3> positions);

  struct Solution {
    std::vector<double> weights;  ///< of +|x - c_i|
    double constant = 0;
    Vec3 linear;
  };
  /// The surface through values (#centres) at the centres. @error Degenerate when the centres lie in one plane.
  [[nodiscard]] Result<Solution> solve(const std::vector<double>& values) const;

  [[nodiscard]] std::size_t size() const { return centres_.size(); }
  [[nodiscard]] const std::vector<Vec3>& centres() const { return centres_; }

 private:
  double span_mm_, ridge_mm_;
  std::vector<Vec3> centres_;
  Eigen::MatrixXd factor_;      ///< lower triangle, #max x #max, the leading #centres rows in use
  Eigen::MatrixXd polynomial_;  ///< factor^-1 P, #max x 4, coordinates in units of the span
};

}  // namespace spinaltap::rbf
