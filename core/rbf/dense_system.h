// core/rbf/dense_system.h - the interpolation system of a few hundred to a few thousand points, solved directly
// (internal).
#pragma once
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "core/base/vec3.h"
#include "core/rbf/simd_dense.h"

namespace spinaltap::rbf {

/// p(x) = c[0] + c[1] x + c[2] y + c[3] z.
using Polynomial = std::array<double, 4>;

/// Solves  sum_j u_j (-|x_i - x_j|) + ridge u_i + p(x_i) = f_i,  P^T u = 0.
///
/// -|x - y| is conditionally positive definite of order one. Adding the diameter of a ball around the points makes it
/// positive definite outright, and drops out of the solution since the u sum to 0: a plain Cholesky factor, and a Schur
/// complement of 4 x 4 for the polynomial. Points in one plane or line (whose polynomials are not all told apart) get
/// the polynomial of least norm.
template <class T>
class DenseSystem {
 public:
  /// Nothing when the matrix is not positive definite in T: points too close for its digits.
  [[nodiscard]] static std::unique_ptr<DenseSystem> make(std::span<const Vec3> points, double ridge, unsigned threads);

  /// @param values f, #points. @param weights u, #points. @return the polynomial.
  Polynomial solve(std::span<const double> values, std::span<double> weights) const;

 private:
  DenseSystem(std::span<const Vec3> points, double ridge);
  void reducePolynomials(std::span<const Vec3> points);

  Vec3 middle_;
  double scale_ = 1;  ///< half the diameter: the factor is of points divided by it
  TiledCholesky<T> factor_;
  std::vector<T> polynomials_;        ///< L^-1 P, 4 columns of paddedSize
  std::array<double, 16> inverse_{};  ///< (P^T A^-1 P)^+
};

}  // namespace spinaltap::rbf
