// core/rbf/system.h - the interpolation system of any number of points (internal).
// After: Saad, "A flexible inner-outer preconditioned GMRES algorithm", SIAM J. Sci. Comput. 14 (1993).
#pragma once
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/base/vec3.h"
#include "core/rbf/dense_system.h"
#include "core/rbf/fast_sum.h"
#include "core/rbf/preconditioner.h"

namespace spinaltap::rbf {

/// How fine the sums of a solver are: Chebyshev nodes an axis, and the precision. Vertebrae to 0.01 mm take seven or
/// eight: fewer to begin with are planned and summed in vain.
struct SumOrder {
  int nodes = 7;
  bool single = true;
};

/// u and p of  sum_j u_j (-|x_i - x_j|) + ridge u_i + p(x_i) = f_i,  P^T u = 0.
struct SystemSolution {
  std::vector<double> weights;
  Polynomial polynomial{};
  int rounds = 0;           ///< products with the whole matrix; 0 when it was solved directly
  double residual_max = 0;  ///< of the equations, as far as the sums that were used can tell
  SumOrder order;           ///< what it took
};

/// Factors once, solves for as many right-hand sides as wanted: directly for up to kDirect points, else by flexible
/// GMRES with fast sums.
class System {
 public:
  static constexpr std::size_t kDirect = 2600;

  enum class Use { Solve, Roughly };

  /// @param points  in any unit, relative to somewhere near; they are copied.
  /// @error Degenerate (points too close together).
  [[nodiscard]] static Result<System> make(std::span<const Vec3> points, double ridge, unsigned threads,
                                           Use use = Use::Solve);

  /// Until every equation is met within `tolerance`, or rounding lets it come no closer: then residual_max tells.
  /// @param first  to begin with; finer where direct sums disagree.
  [[nodiscard]] SystemSolution solve(std::span<const double> values, double tolerance,
                                     const std::function<void(double)>& progress = {}, SumOrder first = {}) const;
  /// Until the residuals' root mean square is as wanted, or some rounds have passed; the sums are rough. For a search
  /// direction.
  /// @pre made for Use::Roughly.
  [[nodiscard]] SystemSolution solveRoughly(std::span<const double> values, double wanted_rms) const;

 private:
  System() = default;
  [[nodiscard]] SystemSolution solveDirectly(std::span<const double> values, double tolerance) const;

  std::vector<Vec3> points_;
  double ridge_ = 0;
  unsigned threads_ = 0;
  std::unique_ptr<DenseSystem<double>> direct_;
  std::unique_ptr<Preconditioner> preconditioner_;
  std::unique_ptr<FastSum> rough_sum_;
};

}  // namespace spinaltap::rbf
