#include "core/rbf/system.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/rbf/direct_sum.h"

namespace spinaltap::rbf {
namespace {

// Of a coarse system, a direction to search in is wanted, not an answer.
constexpr int kRoughNodes = 5, kRoughRounds = 8;
constexpr int kMostRounds = 60, kRestart = 30, kLastSingle = 8, kRefinements = 4;
// A sum's order is checked against direct sums at this many points.
constexpr std::size_t kChecked = 128;

double largest(std::span<const double> v) {
  double most = 0;
  for (const double x : v) most = std::max(most, std::abs(x));
  return most;
}

double product(std::span<const double> a, std::span<const double> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

void addScaled(std::span<double> to, double share, std::span<const double> what) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += share * what[i];
}

double valueAt(const Polynomial& p, const Vec3& x) { return p[0] + p[1] * x.x + p[2] * x.y + p[3] * x.z; }

std::vector<double> exactResidual(const std::vector<Vec3>& points, double ridge, std::span<const double> values,
                                  const std::vector<double>& weights, const Polynomial& p) {
  std::vector<double> out = distancesAmong(Coordinates(points), weights, 1);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] += values[i] - ridge * weights[i] - valueAt(p, points[i]);
  return out;
}

FastSumOptions sumOptions(SumOrder order, unsigned threads) {
  FastSumOptions options;
  options.nodes = order.nodes, options.threads = threads, options.leaf_size = 200;
  options.single_error = order.single ? std::numeric_limits<double>::infinity() : 0;
  return options;
}

void applyMatrix(const FastSum& sum, const std::vector<Vec3>& points, double ridge, std::span<const double> weights,
                 const Polynomial& p, std::span<double> out) {
  sum.values(weights, out);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = -out[i] + ridge * weights[i] + valueAt(p, points[i]);
}

/// The matrix, with sums as fine as they have to be.
class Matrix {
 public:
  Matrix(const std::vector<Vec3>& points, double ridge, SumOrder order, unsigned threads)
      : points_(points), ridge_(ridge), order_(order), threads_(threads), coordinates_(points), checked_({}) {
    std::vector<Vec3> checked;
    for (std::size_t n = 0; n < kChecked; ++n) checked.push_back(points_[checkedPoint(n)]);
    checked_ = Coordinates(checked);
    plan();
  }

  void apply(std::span<const double> weights, const Polynomial& p, std::span<double> out) const {
    applyMatrix(*sum_, points_, ridge_, weights, p, out);
  }

  /// The largest error of apply() over some points, for these weights.
  [[nodiscard]] double errorOf(std::span<const double> weights, std::span<const double> applied,
                               const Polynomial& p) const {
    const std::vector<double> direct = distancesFrom(checked_, coordinates_, weights, threads_);
    double most = 0;
    for (std::size_t n = 0; n < kChecked; ++n) {
      const std::size_t i = checkedPoint(n);
      most = std::max(most, std::abs(-direct[n] + ridge_ * weights[i] + valueAt(p, points_[i]) - applied[i]));
    }
    return most;
  }

  /// A finer sum; false when there is none.
  bool refine() {
    // Another node an axis gains a factor of four and more; single precision ends somewhere near eight.
    if (order_.nodes >= kLastSingle && order_.single) {
      order_.single = false;
    } else if (order_.nodes < Chebyshev::kMost) {
      ++order_.nodes;
    } else {
      return false;
    }
    plan();
    return true;
  }

  [[nodiscard]] SumOrder order() const { return order_; }

 private:
  [[nodiscard]] std::size_t checkedPoint(std::size_t n) const { return n * points_.size() / kChecked; }
  void plan() { sum_ = std::make_unique<FastSum>(points_, points_, sumOptions(order_, threads_)); }

  const std::vector<Vec3>& points_;
  double ridge_;
  SumOrder order_;
  unsigned threads_;
  Coordinates coordinates_, checked_;
  std::unique_ptr<FastSum> sum_;
};

/// One cycle of flexible GMRES: the search directions so far, and the small least-squares problem by Givens rotations.
class Cycle {
 public:
  Cycle(std::vector<double> residual, double length) {
    for (double& r : residual) r /= length;
    v_.push_back(std::move(residual));
    rhs_.push_back(length);
  }

  [[nodiscard]] const std::vector<double>& newest() const { return v_.back(); }

  /// @param z the preconditioned direction, @param az what the matrix makes of it. False when nothing new is left.
  bool add(std::vector<double> z, const Polynomial& p, std::vector<double> az) {
    std::vector<double> h(v_.size() + 1);
    const double before = std::sqrt(product(az, az));
    for (int twice = 0; twice < 2; ++twice) {
      for (std::size_t k = 0; k < v_.size(); ++k) {
        const double share = product(az, v_[k]);
        h[k] += share;
        addScaled(az, -share, v_[k]);
      }
    }
    const double length = std::sqrt(product(az, az));
    h[v_.size()] = length;
    rotate(h);
    z_.push_back(std::move(z)), p_.push_back(p);
    if (!(length > 1e-14 * before)) return false;
    for (double& x : az) x /= length;
    v_.push_back(std::move(az));
    return true;
  }

  /// The 2-norm of what is left.
  [[nodiscard]] double left() const { return std::abs(rhs_.back()); }

  /// Adds the best combination so far.
  void addTo(std::vector<double>& weights, Polynomial& polynomial) const {
    const std::size_t n = z_.size();
    std::vector<double> y(rhs_.begin(), rhs_.begin() + static_cast<std::ptrdiff_t>(n));
    for (std::size_t k = n; k-- > 0;) {
      for (std::size_t m = k + 1; m < n; ++m) y[k] -= columns_[m][k] * y[m];
      y[k] /= columns_[k][k];
    }
    for (std::size_t k = 0; k < n; ++k) {
      addScaled(weights, y[k], z_[k]);
      for (std::size_t c = 0; c < 4; ++c) polynomial[c] += y[k] * p_[k][c];
    }
  }

 private:
  void rotate(std::vector<double> h) {
    const std::size_t k = columns_.size();
    for (std::size_t m = 0; m < k; ++m) {
      const double a = h[m], b = h[m + 1];
      h[m] = cosines_[m] * a + sines_[m] * b;
      h[m + 1] = -sines_[m] * a + cosines_[m] * b;
    }
    const double r = std::sqrt(h[k] * h[k] + h[k + 1] * h[k + 1]);
    cosines_.push_back(r > 0 ? h[k] / r : 1), sines_.push_back(r > 0 ? h[k + 1] / r : 0);
    h[k] = r;
    rhs_.push_back(-sines_[k] * rhs_[k]);
    rhs_[k] *= cosines_[k];
    columns_.push_back(std::move(h));
  }

  std::vector<std::vector<double>> v_, z_;
  std::vector<Polynomial> p_;
  std::vector<std::vector<double>> columns_;
  std::vector<double> cosines_, sines_, rhs_;
};

/// Rounds until the cycle's residual is as wanted. Returns how many.
template <class Apply>
int search(const Preconditioner& preconditioner, const Apply& apply, Cycle& cycle, double wanted, int most,
           const std::function<void(double)>& progress) {
  int rounds = 0;
  for (bool more = true; more && rounds < most && cycle.left() > wanted; ++rounds) {
    std::vector<double> z(cycle.newest().size()), az(cycle.newest().size());
    const Polynomial p = preconditioner.apply(cycle.newest(), z);
    apply(z, p, az);
    more = cycle.add(std::move(z), p, std::move(az));
    if (progress) progress(cycle.left());
  }
  return rounds;
}

}  // namespace

Result<System> System::make(std::span<const Vec3> points, double ridge, unsigned threads, Use use) {
  System out;
  out.points_.assign(points.begin(), points.end());
  out.ridge_ = ridge, out.threads_ = threads;
  if (points.size() <= kDirect) {
    out.direct_ = DenseSystem<double>::make(points, ridge, threads);
    if (!out.direct_) return fail(ErrorCode::Degenerate, "samples lie too close together for double precision");
    return out;
  }
  auto made = Preconditioner::make(out.points_, ridge, threads);
  if (!made) return tl::unexpected(made.error());
  out.preconditioner_ = std::make_unique<Preconditioner>(std::move(*made));
  if (use == Use::Roughly)
    out.rough_sum_ = std::make_unique<FastSum>(out.points_, out.points_, sumOptions({kRoughNodes, true}, threads));
  return out;
}

SystemSolution System::solveDirectly(std::span<const double> values, double tolerance) const {
  SystemSolution out;
  const std::size_t n = points_.size();
  out.weights.assign(n, 0.0);
  std::vector<double> residual(values.begin(), values.end()), correction(n);
  out.residual_max = largest(residual);
  // Once is enough for all but badly conditioned sets; each further time takes off what the factor's rounding left.
  for (int time = 0; time < kRefinements; ++time) {
    const Polynomial p = direct_->solve(residual, correction);
    SystemSolution next = out;
    addScaled(next.weights, 1, correction);
    for (std::size_t c = 0; c < 4; ++c) next.polynomial[c] += p[c];
    residual = exactResidual(points_, ridge_, values, next.weights, next.polynomial);
    next.residual_max = largest(residual);
    if (time > 0 && !(next.residual_max < out.residual_max)) break;
    out = std::move(next);
    if (out.residual_max <= tolerance) break;
  }
  return out;
}

SystemSolution System::solveRoughly(std::span<const double> values, double wanted_rms) const {
  SystemSolution out;
  out.weights.assign(points_.size(), 0.0);
  if (direct_) {
    out.polynomial = direct_->solve(values, out.weights);
    return out;
  }
  const auto apply = [this](std::span<const double> weights, const Polynomial& p, std::span<double> applied) {
    applyMatrix(*rough_sum_, points_, ridge_, weights, p, applied);
  };
  std::vector<double> residual(values.begin(), values.end());
  const double length = std::sqrt(product(residual, residual));
  if (!(length > 0)) return out;
  Cycle cycle(std::move(residual), length);
  out.rounds = search(*preconditioner_, apply, cycle, wanted_rms * std::sqrt(static_cast<double>(points_.size())),
                      kRoughRounds, {});
  cycle.addTo(out.weights, out.polynomial);
  return out;
}

SystemSolution System::solve(std::span<const double> values, double tolerance,
                             const std::function<void(double)>& progress, SumOrder order) const {
  if (direct_) return solveDirectly(values, tolerance);
  SystemSolution out;
  const std::size_t n = points_.size();
  out.weights.assign(n, 0.0);
  Matrix matrix(points_, ridge_, order, threads_);
  // The answer is as good as the sums that lead to it: take finer ones where direct sums disagree.
  const auto sums_agree = [&](std::span<const double> weights, const Polynomial& p, std::span<double> out_values,
                              double size) {
    while (matrix.errorOf(weights, out_values, p) * size > 0.1 * tolerance && matrix.refine())
      matrix.apply(weights, p, out_values);
  };
  std::vector<double> residual(values.begin(), values.end()), applied(n);
  const double first = largest(residual);
  const auto report = [&](double share) {
    // Every round takes about the same factor off the residual.
    if (progress && first > tolerance)
      progress(std::clamp(std::log(1 / share) / std::log(first / tolerance), 0.0, 1.0));
  };
  double before = std::numeric_limits<double>::infinity(), share = 1;
  while (out.rounds < kMostRounds) {
    out.residual_max = largest(residual);
    if (out.residual_max <= tolerance || !(out.residual_max < 0.5 * before)) break;
    before = out.residual_max;
    const double length = std::sqrt(product(residual, residual));
    // A fifth of the tolerance in the mean usually leaves nothing above it; if not, the next cycle goes by the largest.
    const double wanted =
        std::min(0.2 * tolerance * std::sqrt(static_cast<double>(n)), 0.4 * length * tolerance / before);
    bool first_direction = true;
    const auto apply = [&](std::span<const double> weights, const Polynomial& p, std::span<double> out_values) {
      matrix.apply(weights, p, out_values);
      if (first_direction) sums_agree(weights, p, out_values, length);
      first_direction = false;
    };
    Cycle cycle(residual, length);
    out.rounds +=
        search(*preconditioner_, apply, cycle, wanted, kRestart, [&](double left) { report(share * left / length); });
    share *= cycle.left() / length;
    cycle.addTo(out.weights, out.polynomial);
    matrix.apply(out.weights, out.polynomial, applied);
    sums_agree(out.weights, out.polynomial, applied, 1);
    for (std::size_t i = 0; i < n; ++i) residual[i] = values[i] - applied[i];
  }
  out.order = matrix.order();
  return out;
}

}  // namespace spinaltap::rbf
