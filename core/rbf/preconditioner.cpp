#include "core/rbf/preconditioner.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/parallel.h"
#include "core/rbf/system.h"

namespace spinaltap::rbf {
namespace {

// Measured on vertebrae (tests/bench): smaller boxes factor sooner but need more rounds.
constexpr std::size_t kInner = 200, kWhole = 480;  // whole: a multiple of the factor's tiles
constexpr double kThinning = 22;
constexpr double kCoarseShare = 0.1;  // what the coarse solution may leave of the residuals

std::vector<Vec3> chosen(std::span<const Vec3> points, const std::vector<std::uint32_t>& indices) {
  std::vector<Vec3> out;
  out.reserve(indices.size());
  for (const std::uint32_t i : indices) out.push_back(points[i]);
  return out;
}

}  // namespace

std::vector<double> polynomialBasis(std::span<const Vec3> points) {
  const std::size_t n = points.size();
  std::vector<double> q(4 * n);
  for (std::size_t i = 0; i < n; ++i)
    q[i] = 1, q[n + i] = points[i].x, q[2 * n + i] = points[i].y, q[3 * n + i] = points[i].z;
  for (std::size_t k = 0; k < 4; ++k) {
    double* const own = q.data() + k * n;
    double before = 0;
    for (std::size_t i = 0; i < n; ++i) before += own[i] * own[i];
    for (int twice = 0; twice < 2; ++twice) {
      for (std::size_t m = 0; m < k; ++m) {
        const double* const other = q.data() + m * n;
        double share = 0;
        for (std::size_t i = 0; i < n; ++i) share += own[i] * other[i];
        for (std::size_t i = 0; i < n; ++i) own[i] -= share * other[i];
      }
    }
    double square = 0;
    for (std::size_t i = 0; i < n; ++i) square += own[i] * own[i];
    const double scale =
        square > 1e-24 * before ? 1 / std::sqrt(square) : 0;  // a plane's normal direction adds nothing
    for (std::size_t i = 0; i < n; ++i) own[i] *= scale;
  }
  return q;
}

void removePolynomials(const std::vector<double>& basis, std::span<double> values) {
  const std::size_t n = values.size();
  for (int twice = 0; twice < 2; ++twice) {
    for (std::size_t k = 0; k < 4; ++k) {
      const double* const q = basis.data() + k * n;
      double share = 0;
      for (std::size_t i = 0; i < n; ++i) share += q[i] * values[i];
      for (std::size_t i = 0; i < n; ++i) values[i] -= share * q[i];
    }
  }
}

Result<Preconditioner> Preconditioner::make(std::span<const Vec3> points, double ridge, unsigned threads) {
  Preconditioner out;
  out.ridge_ = ridge, out.threads_ = threads;
  std::vector<Subdomain> domains = cutIntoSubdomains(points, kInner, kWhole);
  out.kept_ = thinOut(points, domains, kThinning);
  out.basis_ = polynomialBasis(points);
  const std::vector<Vec3> kept = chosen(points, out.kept_);
  FastSumOptions rough;  // the answer is only a direction to search in
  rough.nodes = 4, rough.single_error = std::numeric_limits<double>::infinity(), rough.threads = threads;
  out.to_kept_ = std::make_unique<FastSum>(points, kept, rough);
  if (auto ok = out.factorBoxes(points, std::move(domains)); !ok) return tl::unexpected(ok.error());
  auto coarse = System::make(kept, ridge, threads, System::Use::Roughly);
  if (!coarse) return tl::unexpected(coarse.error());
  out.coarse_ = std::make_shared<const System>(std::move(*coarse));
  return out;
}

Result<void> Preconditioner::factorBoxes(std::span<const Vec3> points, std::vector<Subdomain> domains) {
  boxes_.resize(domains.size());
  std::vector<std::uint8_t> failed(domains.size(), 0);
  parallelBlocks(domains.size(), 1, threads_, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const std::vector<Vec3> mine = chosen(points, domains[n].points);
      boxes_[n].domain = std::move(domains[n]);
      if (auto single = DenseSystem<float>::make(mine, ridge_, 1)) {
        boxes_[n].system = std::move(single);
      } else if (auto wide = DenseSystem<double>::make(mine, ridge_, 1)) {
        boxes_[n].system = std::move(wide);
      } else {
        failed[n] = 1;
      }
    }
  });
  if (std::find(failed.begin(), failed.end(), 1) == failed.end()) return {};
  return fail(ErrorCode::Degenerate, "samples lie too close together for double precision");
}

void Preconditioner::solveBoxes(std::span<const double> residuals, std::span<double> weights) const {
  parallelBlocks(boxes_.size(), 4, threads_, [&](std::size_t begin, std::size_t end) {
    std::vector<double> values, solved;
    for (std::size_t n = begin; n < end; ++n) {
      const Box& box = boxes_[n];
      values.clear();
      for (const std::uint32_t i : box.domain.points) values.push_back(residuals[i]);
      solved.resize(values.size());
      std::visit([&](const auto& system) { system->solve(values, solved); }, box.system);
      for (std::size_t i = 0; i < box.domain.inner; ++i) weights[box.domain.points[i]] = solved[i];
    }
  });
  removePolynomials(basis_, weights);
}

Polynomial Preconditioner::apply(std::span<const double> residuals, std::span<double> weights) const {
  solveBoxes(residuals, weights);
  std::vector<double> left(kept_.size());
  to_kept_->values(weights, left);
  for (std::size_t i = 0; i < left.size(); ++i) left[i] += residuals[kept_[i]] - ridge_ * weights[kept_[i]];
  // The boxes alone leave far more than they were given, so what is good enough is measured by what was given.
  double squares = 0;
  for (const double r : residuals) squares += r * r;
  const double wanted = kCoarseShare * std::sqrt(squares / static_cast<double>(residuals.size()));
  const SystemSolution coarse = coarse_->solveRoughly(left, wanted);
  for (std::size_t i = 0; i < kept_.size(); ++i) weights[kept_[i]] += coarse.weights[i];
  return coarse.polynomial;
}

}  // namespace spinaltap::rbf
