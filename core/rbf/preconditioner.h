// core/rbf/preconditioner.h - a cheap approximate inverse of the interpolation system (internal).
// After: Beatson, Light and Billings, "Fast solution of the radial basis function interpolation equations: domain
// decomposition methods", SIAM J. Sci. Comput. 22 (2000).
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "core/base/result.h"
#include "core/rbf/dense_system.h"
#include "core/rbf/fast_sum.h"
#include "core/rbf/subdomains.h"

namespace spinaltap::rbf {

class System;

/// Restricted additive Schwarz on two levels: the system is solved in overlapping boxes, and what a box says of its own
/// points is kept; what then remains is solved on a thinned set of points, which is a System of its own: a small one is
/// solved directly, a larger one roughly by this same way. The boxes' factors are in single precision, or in double
/// where that fails.
class Preconditioner {
 public:
  /// @error Degenerate when a box cannot be factored even in double.
  [[nodiscard]] static Result<Preconditioner> make(std::span<const Vec3> points, double ridge, unsigned threads);

  /// weights and the returned polynomial about solve the system for these residuals; P^T weights = 0.
  Polynomial apply(std::span<const double> residuals, std::span<double> weights) const;

 private:
  struct Box {
    Subdomain domain;
    std::variant<std::unique_ptr<DenseSystem<float>>, std::unique_ptr<DenseSystem<double>>> system;
  };
  Preconditioner() = default;
  Result<void> factorBoxes(std::span<const Vec3> points, std::vector<Subdomain> domains);
  void solveBoxes(std::span<const double> residuals, std::span<double> weights) const;

  double ridge_ = 0;
  unsigned threads_ = 0;
  std::vector<Box> boxes_;
  std::vector<double> basis_;         ///< polynomialBasis of the points
  std::vector<std::uint32_t> kept_;   ///< the thinned set: indices into the points
  std::unique_ptr<FastSum> to_kept_;  ///< from all points to the thinned set
  std::shared_ptr<const System> coarse_;
};

/// Four orthonormal columns that span 1, x, y, z on the points, one behind the other.
[[nodiscard]] std::vector<double> polynomialBasis(std::span<const Vec3> points);
/// values minus their part in the columns' span.
void removePolynomials(const std::vector<double>& basis, std::span<double> values);

}  // namespace spinaltap::rbf
