#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/rbf/prepare.h"
#include "core/rbf/rbf.h"
#include "core/rbf/solver.h"
#include "core/rbf/summation.h"

namespace spinaltap::rbf {
namespace {

constexpr std::size_t kFirstCentres = 50;
// Each round adds this share of the centres so far: more would pick crowds around one bad spot, less costs rounds.
constexpr double kGrowth = 0.3;
constexpr int kAveragingRounds = 4;
constexpr std::size_t kMostCentres = 20'000;  // 3.2 GB of factor, and an hour: beyond this, dense is the wrong way

/// Refuses points closer than a radius to one already taken (cells as wide as the radius, 27 looked at).
class Spacing {
 public:
  explicit Spacing(double radius) : radius_(radius) {}

  bool take(const Vec3& p) {
    const std::int64_t i = cell(p.x), j = cell(p.y), k = cell(p.z);
    for (std::int64_t dk = -1; dk <= 1; ++dk)
      for (std::int64_t dj = -1; dj <= 1; ++dj)
        for (std::int64_t di = -1; di <= 1; ++di)
          if (crowded(key(i + di, j + dj, k + dk), p)) return false;
    cells_[key(i, j, k)].push_back(p);
    return true;
  }

 private:
  [[nodiscard]] std::int64_t cell(double x) const { return static_cast<std::int64_t>(std::floor(x / radius_)); }
  static std::int64_t key(std::int64_t i, std::int64_t j, std::int64_t k) {
    return ((i & 0x1fffff) << 42) | ((j & 0x1fffff) << 21) | (k & 0x1fffff);
  }
  [[nodiscard]] bool crowded(std::int64_t at, const Vec3& p) const {
    const auto found = cells_.find(at);
    if (found == cells_.end()) return false;
    return std::any_of(found->second.begin(), found->second.end(),
                       [&](const Vec3& q) { return norm(q - p) < radius_; });
  }

  double radius_;
  std::unordered_map<std::int64_t, std::vector<Vec3>> cells_;
};

/// One greedy fit in progress.
class Greedy {
 public:
  Greedy(PreparedSamples samples, const FitOptions& options)
      : samples_(std::move(samples)),
        options_(options),
        most_(std::min(options.max_centres, samples_.positions.size())),
        solver_(samples_.span_mm, options.smoothing, most_),
        taken_(samples_.positions.size(), 0),
        residuals_(samples_.positions.size(), 0.0) {}

  Result<Fit> run(const Progress& progress) {
    if (auto ok = add(firstCentres()); !ok) return tl::unexpected(ok.error());
    while (true) {
      if (auto ok = refit(); !ok) return tl::unexpected(ok.error());
      if (progress) progress(static_cast<double>(solver_.size()) / static_cast<double>(most_));
      const std::vector<std::size_t> worst = worstSamples();
      if (worst.empty()) break;
      if (auto ok = add(worst); !ok) return tl::unexpected(ok.error());
    }
    if (options_.smoothing > 0) {
      if (auto ok = averageNoise(); !ok) return tl::unexpected(ok.error());
    }
    if (progress) progress(1.0);
    return finish();
  }

 private:
  /// Farthest points first: an even spread, never in one plane when the samples are not.
  [[nodiscard]] std::vector<std::size_t> firstCentres() const {
    const auto& p = samples_.positions;
    std::vector<double> distance(p.size(), std::numeric_limits<double>::infinity());
    std::vector<std::size_t> out{0};
    while (out.size() < std::min(kFirstCentres, most_)) {
      for (std::size_t i = 0; i < p.size(); ++i) distance[i] = std::min(distance[i], norm(p[i] - p[out.back()]));
      const auto farthest = std::max_element(distance.begin(), distance.end());
      out.push_back(static_cast<std::size_t>(farthest - distance.begin()));
    }
    return out;
  }

  Result<void> add(const std::vector<std::size_t>& chosen) {
    std::vector<Vec3> positions;
    for (const std::size_t i : chosen) {
      positions.push_back(samples_.positions[i]);
      targets_.push_back(samples_.distances[i]);
      taken_[i] = 1;
    }
    return solver_.add(positions);
  }

  Result<void> refit() {
    auto solution = solver_.solve(targets_);
    if (!solution) return tl::unexpected(solution.error());
    model_.centres = solver_.centres();
    model_.weights = std::move(solution->weights);
    model_.constant = solution->constant;
    model_.linear = solution->linear;
    sumValues(FlatModel(model_), samples_.positions, residuals_);
    for (std::size_t i = 0; i < residuals_.size(); ++i) residuals_[i] -= samples_.distances[i];
    return {};
  }

  /// The next centres: the worst samples beyond the tolerance that do not crowd each other. Empty when done.
  [[nodiscard]] std::vector<std::size_t> worstSamples() const {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < residuals_.size(); ++i) {
      if (taken_[i] == 0 && std::abs(residuals_[i]) > options_.tolerance_mm) order.push_back(i);
    }
    std::sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
      const double ra = std::abs(residuals_[a]), rb = std::abs(residuals_[b]);
      return ra != rb ? ra > rb : a < b;
    });
    const double n = static_cast<double>(solver_.size());
    const std::size_t room = most_ - solver_.size();
    const std::size_t wanted = std::min(room, static_cast<std::size_t>(std::ceil(kGrowth * n)));
    // n centres spread over a surface as large as the span squared are about this far apart.
    Spacing spacing(0.5 * samples_.span_mm / std::sqrt(n));
    std::vector<std::size_t> out;
    for (const std::size_t i : order) {
      if (out.size() == wanted) break;
      if (spacing.take(samples_.positions[i])) out.push_back(i);
    }
    return out;
  }

  /// A centre's value comes from one noisy sample; its neighbours know better. Moves every centre's target by the mean
  /// residual of the samples nearest to it and solves again, a few times: the model then meets local means.
  Result<void> averageNoise() {
    const std::vector<std::size_t> nearest = nearestCentres();
    for (int round = 0; round < kAveragingRounds; ++round) {
      std::vector<double> sum(targets_.size(), 0.0), count(targets_.size(), 0.0);
      for (std::size_t i = 0; i < nearest.size(); ++i) sum[nearest[i]] += residuals_[i], count[nearest[i]] += 1;
      for (std::size_t c = 0; c < targets_.size(); ++c) targets_[c] -= sum[c] / std::max(1.0, count[c]);
      if (auto ok = refit(); !ok) return ok;
    }
    return {};
  }

  [[nodiscard]] std::vector<std::size_t> nearestCentres() const;

  [[nodiscard]] Fit finish() {
    Fit fit;
    FitReport& r = fit.report;
    r.samples = samples_.positions.size();
    r.centres = solver_.size();
    double squares = 0;
    for (const double e : residuals_) {
      r.residual_max_mm = std::max(r.residual_max_mm, std::abs(e));
      squares += e * e;
    }
    r.residual_rms_mm = std::sqrt(squares / static_cast<double>(residuals_.size()));
    for (const double w : model_.weights) r.sum_abs_weights += std::abs(w);
    r.reached_tolerance = r.residual_max_mm <= options_.tolerance_mm;
    model_.centroid_patient = samples_.centroid_patient;
    fit.model = std::move(model_);
    return fit;
  }

  PreparedSamples samples_;
  FitOptions options_;
  std::size_t most_;
  GrowingSolver solver_;
  std::vector<std::uint8_t> taken_;
  std::vector<double> targets_;    ///< #centres: the values the surface is drawn through (or near, with a ridge)
  std::vector<double> residuals_;  ///< #samples: model minus sample
  Model model_;                    ///< its centroid stays 0 until the end: the samples are relative already
};

/// Brute force, centre by centre, over contiguous arrays: a tenth of one refit.
std::vector<std::size_t> Greedy::nearestCentres() const {
  const auto& p = samples_.positions;
  const std::vector<Vec3>& centres = solver_.centres();
  std::vector<std::size_t> out(p.size(), 0);
  for (std::size_t i = 0; i < p.size(); ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < centres.size(); ++c) {
      const Vec3 d = p[i] - centres[c];
      const double square = dot(d, d);
      if (square < least) least = square, out[i] = c;
    }
  }
  return out;
}

}  // namespace

Result<Fit> fit(const Samples& samples, const FitOptions& options, const Progress& progress) {
  if (!(options.tolerance_mm >= 0) || !std::isfinite(options.tolerance_mm)) {
    return fail(ErrorCode::InvalidArgument, "fit tolerance is negative or not finite");
  }
  if (!(options.smoothing >= 0) || !std::isfinite(options.smoothing)) {
    return fail(ErrorCode::InvalidArgument, "fit smoothing is negative or not finite");
  }
  if (std::min(options.max_centres, samples.positions.size()) > kMostCentres) {
    return fail(ErrorCode::Limit, "a dense fit takes at most " + std::to_string(kMostCentres) + " centres");
  }
  if (options.max_centres < 4) return fail(ErrorCode::InvalidArgument, "a fit needs at least 4 centres");
  auto prepared = prepare(samples);
  if (!prepared) return tl::unexpected(prepared.error());
  return Greedy(std::move(*prepared), options).run(progress);
}

}  // namespace spinaltap::rbf
