#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/rbf/direct_sum.h"
#include "core/rbf/fast_sum.h"
#include "core/rbf/rbf.h"

namespace spinaltap::rbf {
namespace {

constexpr std::size_t kBlock = 64;                   // points that one thread takes at a time
constexpr std::size_t kPass = 20'000;                // and of those that cost little each
constexpr std::size_t kWorthAThread = 200'000;       // pairs
constexpr std::size_t kWorthFastSums = 4'000'000;    // pairs: below, planning costs more than it saves
constexpr double kPreparedRadii = 1.25;              // points nearer have sums prepared for them
constexpr double kFarRadii = 4;                      // farther points are summed directly
constexpr std::size_t kFewCentres = 250;             // sums of fewer are always direct
constexpr std::size_t kCrowds = 24, kInACrowd = 12;  // places at which sums are tried out
// Of the tolerance, what they may use there: of a million other places, the worst was wrong by three times as much.
constexpr double kAtTrials = 0.2;

unsigned usefulThreads(const Model& model, std::size_t points, unsigned threads) {
  return std::uint64_t{points} * (model.centres.size() + 1) < kWorthAThread ? 1 : threads;
}

/// The polynomial, and the bound beyond the ball.
double finished(const Model& m, const Vec3& p, double sum) {
  const double s = sum + m.constant + dot(m.linear, p);
  const double beyond = norm(p) - m.radius_mm;
  return m.radius_mm > 0 && beyond > 0 ? std::max(s, beyond) : s;
}

/// The bound's own slope counts where it is the larger one.
Vec3 finishedGradient(const Model& m, const Vec3& p, double value, const Vec3& sum) {
  const double beyond = norm(p) - m.radius_mm;
  return m.radius_mm > 0 && beyond > 0 && beyond > value ? normalized(p) : sum + m.linear;
}

void directSums(const Model& m, const Coordinates& centres, const Coordinates& points, std::span<double> out,
                unsigned threads) {
  parallelBlocks(out.size(), kBlock, usefulThreads(m, out.size(), threads), [&](std::size_t begin, std::size_t end) {
    std::fill(out.begin() + static_cast<std::ptrdiff_t>(begin), out.begin() + static_cast<std::ptrdiff_t>(end), 0.0);
    addExactDistances(points.part(begin, end), centres.part(0, m.centres.size()), m.weights.data(), out.data() + begin);
  });
}

void directSlopes(const Model& m, const Coordinates& centres, const Coordinates& points, std::span<Vec3> out,
                  unsigned threads) {
  parallelBlocks(out.size(), kBlock, usefulThreads(m, out.size(), threads), [&](std::size_t begin, std::size_t end) {
    std::vector<double> x(end - begin, 0.0), y = x, z = x;
    addExactDirections(points.part(begin, end), centres.part(0, m.centres.size()), m.weights.data(), x.data(), y.data(),
                       z.data());
    for (std::size_t i = begin; i < end; ++i) out[i] = {x[i - begin], y[i - begin], z[i - begin]};
  });
}

/// Points by how their sums are best found.
struct Regions {
  std::vector<std::size_t> near, around, far;  ///< within the prepared cube, within fast sums' reach, and beyond
};

Regions regionsOf(const Model& m, const RootCube& prepared, std::span<const Vec3> points, unsigned threads) {
  const double reach = kFarRadii * std::max(m.radius_mm, std::numeric_limits<double>::min());
  std::vector<std::uint8_t> region(points.size());
  parallelBlocks(points.size(), kPass, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = points[i] - m.centroid_patient;
      region[i] = prepared.holds(p) ? 0 : norm(p) <= reach ? 1 : 2;
    }
  });
  Regions out;
  out.near.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    (region[i] == 0 ? out.near : region[i] == 1 ? out.around : out.far).push_back(i);
  return out;
}

std::vector<Vec3> relative(const Model& m, std::span<const Vec3> points, const std::vector<std::size_t>& chosen,
                           unsigned threads) {
  std::vector<Vec3> out(chosen.size());
  parallelBlocks(chosen.size(), kPass, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) out[n] = points[chosen[n]] - m.centroid_patient;
  });
  return out;
}

std::vector<Vec3> chosenOf(std::span<const Vec3> points, const std::vector<std::size_t>& chosen) {
  std::vector<Vec3> out;
  out.reserve(chosen.size());
  for (const std::size_t i : chosen) out.push_back(points[i]);
  return out;
}

FastSumOptions optionsOf(const Model& m, double tolerance, double error, unsigned threads, std::size_t points) {
  FastSumOptions o;
  o.weights = m.weights, o.error = error, o.single_error = 0.03 * tolerance, o.threads = threads;
  // Measured: few points are best served by small cubes, a million by near sums over larger ones.
  o.target_leaf_size = points > 200'000 ? 400 : 120;
  return o;
}

/// Where sums are likely to be worst: crowds of places around the centres of the largest weights, apart from each
/// other, and for the rest around every n-th centre and anywhere in the ball.
std::vector<Vec3> trialPlaces(const Model& m) {
  const std::size_t n = m.centres.size();
  const RootCube root = RootCube::around(m.centres);
  std::vector<std::size_t> by_weight(n);
  for (std::size_t i = 0; i < n; ++i) by_weight[i] = i;
  std::sort(by_weight.begin(), by_weight.end(), [&](std::size_t a, std::size_t b) {
    const double wa = std::abs(m.weights[a]), wb = std::abs(m.weights[b]);
    return wa != wb ? wa > wb : a < b;
  });
  const double apart = 0.1 * root.half;
  std::vector<Vec3> crowds;
  for (std::size_t k = 0; k < n && crowds.size() < kCrowds / 2; ++k) {
    const Vec3& c = m.centres[by_weight[k]];
    if (std::all_of(crowds.begin(), crowds.end(), [&](const Vec3& other) { return norm(other - c) > apart; }))
      crowds.push_back(c);
  }
  Random random(n);
  while (crowds.size() < kCrowds) {
    const Vec3 anywhere = Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)} * root.half;
    crowds.push_back(crowds.size() % 2 == 0 ? m.centres[crowds.size() * n / kCrowds] : root.middle + anywhere);
  }
  std::vector<Vec3> places;
  for (const Vec3& crowd : crowds) {
    for (std::size_t k = 0; k < kInACrowd; ++k)
      places.push_back(crowd +
                       Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)} * (0.3 * apart));
  }
  return places;
}

}  // namespace

void evaluate(const Model& model, std::span<const Vec3> points, std::span<double> out, unsigned threads) {
  assert(points.size() == out.size());
  const Coordinates at(points, model.centroid_patient), centres(model.centres);
  directSums(model, centres, at, out, threads);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = finished(model, at.at(i), out[i]);
}

void evaluateGradient(const Model& model, std::span<const Vec3> points, std::span<Vec3> out, unsigned threads) {
  assert(points.size() == out.size());
  const Coordinates at(points, model.centroid_patient), centres(model.centres);
  std::vector<double> values(points.size());
  directSums(model, centres, at, values, threads);
  directSlopes(model, centres, at, out, threads);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Vec3 p = at.at(i);
    out[i] = finishedGradient(model, p, values[i] + model.constant + dot(model.linear, p), out[i]);
  }
}

struct Evaluator::Prepared {
  FastSources sources;
  FastSources::Weighted weighted;

  static RootCube around(const Model& m) {
    RootCube root = RootCube::around(m.centres);
    root.half *= kPreparedRadii;
    return root;
  }
  Prepared(const Model& m, const FastSumOptions& options)
      : sources(m.centres, around(m), options), weighted(sources.weigh(m.weights)) {}
};

Evaluator::Evaluator(Model model, double tolerance_mm, unsigned threads)
    : model_(std::move(model)), tolerance_(tolerance_mm), threads_(threads) {
  assert(tolerance_mm > 0);
  if (model_.centres.size() < kFewCentres) return;
  const std::vector<Vec3> places = trialPlaces(model_);
  const Coordinates at(places), centres(model_.centres);
  std::vector<double> direct(places.size()), fast(places.size());
  directSums(model_, centres, at, direct, threads_);
  FarOrders orders;  // finer sums share most of them
  for (double error = 0.1 * tolerance_mm; error > 1e-4 * tolerance_mm; error *= 0.3) {
    FastSumOptions options = optionsOf(model_, tolerance_, error, threads_, 0);
    options.target_leaf_size = 2;  // cubes as small as those of many points
    options.orders = &orders;
    FastSum(model_.centres, places, options).values(model_.weights, fast);
    double most = 0;
    for (std::size_t k = 0; k < places.size(); ++k) most = std::max(most, std::abs(fast[k] - direct[k]));
    if (!(most <= kAtTrials * tolerance_mm)) continue;
    error_ = error;
    prepared_ = std::make_shared<const Prepared>(model_, options);
    return;
  }
}

/// use(chosen points, their places relative to the centroid, their sum) for those within reach of fast sums, and
/// direct(chosen points) for the others.
template <class Use, class Direct>
void Evaluator::split(std::span<const Vec3> points, const Use& use, const Direct& direct) const {
  const Regions regions = regionsOf(model_, prepared_->sources.tree().root(), points, threads_);
  if (!regions.near.empty()) {
    const std::vector<Vec3> at = relative(model_, points, regions.near, threads_);
    use(regions.near, at,
        FastSum({prepared_, &prepared_->sources}, at, optionsOf(model_, tolerance_, error_, threads_, at.size())),
        prepared_->weighted);
  }
  if (!regions.around.empty()) {
    const std::vector<Vec3> at = relative(model_, points, regions.around, threads_);
    const FastSumOptions options = optionsOf(model_, tolerance_, error_, threads_, at.size());
    const auto sources =
        std::make_shared<const FastSources>(model_.centres, RootCube::around(model_.centres, at), options);
    use(regions.around, at, FastSum(sources, at, options), sources->weigh(model_.weights));
  }
  if (!regions.far.empty()) direct(regions.far);
}

void Evaluator::values(std::span<const Vec3> points, std::span<double> out) const {
  if (prepared_ == nullptr || std::uint64_t{points.size()} * model_.centres.size() < kWorthFastSums)
    return evaluate(model_, points, out, threads_);
  split(
      points,
      [&](const auto& chosen, const auto& at, const FastSum& sum, const FastSources::Weighted& weighted) {
        std::vector<double> sums(at.size());
        sum.values(weighted, sums);
        parallelBlocks(at.size(), kPass, threads_, [&](std::size_t begin, std::size_t end) {
          for (std::size_t n = begin; n < end; ++n) out[chosen[n]] = finished(model_, at[n], sums[n]);
        });
      },
      [&](const auto& chosen) {
        std::vector<double> s(chosen.size());
        evaluate(model_, chosenOf(points, chosen), s, threads_);
        for (std::size_t n = 0; n < chosen.size(); ++n) out[chosen[n]] = s[n];
      });
}

void Evaluator::gradients(std::span<const Vec3> points, std::span<Vec3> out) const {
  if (prepared_ == nullptr || std::uint64_t{points.size()} * model_.centres.size() < kWorthFastSums)
    return evaluateGradient(model_, points, out, threads_);
  split(
      points,
      [&](const auto& chosen, const auto& at, const FastSum& sum, const FastSources::Weighted& weighted) {
        std::vector<Vec3> slopes(at.size());
        sum.gradients(weighted, slopes);
        parallelBlocks(at.size(), kPass, threads_, [&](std::size_t begin, std::size_t end) {
          for (std::size_t n = begin; n < end; ++n) out[chosen[n]] = slopes[n] + model_.linear;
        });
        pointAwayBeyond(at, chosen, points, out);
      },
      [&](const auto& chosen) {
        std::vector<Vec3> slopes(chosen.size());
        evaluateGradient(model_, chosenOf(points, chosen), slopes, threads_);
        for (std::size_t n = 0; n < chosen.size(); ++n) out[chosen[n]] = slopes[n];
      });
}

void Evaluator::pointAwayBeyond(std::span<const Vec3> at, std::span<const std::size_t> near,
                                std::span<const Vec3> points, std::span<Vec3> out) const {
  std::vector<std::size_t> beyond;
  for (std::size_t n = 0; n < near.size(); ++n) {
    if (norm(at[n]) > model_.radius_mm) beyond.push_back(n);
  }
  if (beyond.empty() || !(model_.radius_mm > 0)) return;
  std::vector<std::size_t> places;
  for (const std::size_t n : beyond) places.push_back(near[n]);
  std::vector<double> s(beyond.size());
  values(chosenOf(points, places), s);
  for (std::size_t n = 0; n < beyond.size(); ++n) {
    const Vec3& p = at[beyond[n]];
    if (s[n] <= norm(p) - model_.radius_mm) out[places[n]] = normalized(p);
  }
}

Field asField(const Model& model, double lipschitz, double tolerance_mm) {
  Field field;
  field.lipschitz = std::max(1.0, lipschitz);
  if (tolerance_mm > 0) {
    const auto evaluator = std::make_shared<const Evaluator>(model, tolerance_mm);
    field.values = [evaluator](std::span<const Vec3> p, std::span<double> out) { evaluator->values(p, out); };
    field.gradients = [evaluator](std::span<const Vec3> p, std::span<Vec3> out) { evaluator->gradients(p, out); };
    return field;
  }
  const auto kept = std::make_shared<const Model>(model);
  field.values = [kept](std::span<const Vec3> p, std::span<double> out) { evaluate(*kept, p, out); };
  field.gradients = [kept](std::span<const Vec3> p, std::span<Vec3> out) { evaluateGradient(*kept, p, out); };
  return field;
}

}  // namespace spinaltap::rbf
