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

constexpr std::size_t kBlock = 64;                 // points that one thread takes at a time
constexpr std::size_t kWorthAThread = 200'000;     // pairs
constexpr std::size_t kWorthFastSums = 4'000'000;  // pairs: below, planning costs more than it saves
constexpr double kFarRadii = 4;                    // farther points are summed directly
constexpr std::size_t kTried = 256;                // places at which an order is tried out

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

/// Which of the points fast sums may take.
std::vector<std::size_t> nearPoints(const Model& m, std::span<const Vec3> points) {
  const double reach = kFarRadii * std::max(m.radius_mm, std::numeric_limits<double>::min());
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (norm(points[i] - m.centroid_patient) <= reach) out.push_back(i);
  }
  return out;
}

std::vector<Vec3> relative(const Model& m, std::span<const Vec3> points, const std::vector<std::size_t>& chosen) {
  std::vector<Vec3> out;
  out.reserve(chosen.size());
  for (const std::size_t i : chosen) out.push_back(points[i] - m.centroid_patient);
  return out;
}

std::vector<Vec3> chosenOf(std::span<const Vec3> points, const std::vector<std::size_t>& chosen) {
  std::vector<Vec3> out;
  out.reserve(chosen.size());
  for (const std::size_t i : chosen) out.push_back(points[i]);
  return out;
}

/// Points that are not chosen.
std::vector<std::size_t> others(std::size_t count, const std::vector<std::size_t>& chosen) {
  std::vector<std::size_t> out;
  std::size_t next = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (next < chosen.size() && chosen[next] == i) {
      ++next;
    } else {
      out.push_back(i);
    }
  }
  return out;
}

FastSumOptions optionsOf(int nodes, bool single_near, unsigned threads, std::size_t points) {
  FastSumOptions o;
  o.nodes = nodes, o.single_near = single_near, o.threads = threads;
  // Measured: few points are best served by small cubes, a million by near sums over large ones.
  o.leaf_size = points > 200'000 ? 240 : 120;
  o.target_leaf_size = points > 200'000 ? 1000 : 120;
  return o;
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

Evaluator::Evaluator(Model model, double tolerance_mm, unsigned threads) : model_(std::move(model)), threads_(threads) {
  assert(tolerance_mm > 0);
  const std::size_t n = model_.centres.size();
  if (n * kTried < 64'000) return;
  // Half beside centres, where near pairs weigh most, half all over the ball, where the largest cubes' errors show; a
  // third of the tolerance there leaves room for places not tried.
  Random random(n);
  std::vector<Vec3> places;
  for (std::size_t k = 0; k < kTried; ++k) {
    const Vec3 away{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    places.push_back(k % 2 == 0 ? model_.centres[k * n / kTried] + away * (0.02 * model_.radius_mm)
                                : away * model_.radius_mm);
  }
  const Coordinates at(places), centres(model_.centres);
  std::vector<double> direct(kTried), fast(kTried);
  directSums(model_, centres, at, direct, threads_);
  const auto error = [&](int nodes, bool single_near) {
    FastSumOptions options = optionsOf(nodes, single_near, threads_, 0);
    options.target_leaf_size = 2;  // cubes as small as those of many points
    FastSum(model_.centres, places, options).values(model_.weights, fast);
    double most = 0;
    for (std::size_t k = 0; k < kTried; ++k) most = std::max(most, std::abs(fast[k] - direct[k]));
    return most;
  };
  const double wanted = tolerance_mm / 3;
  for (int nodes = 6; nodes <= Chebyshev::kMost;) {
    const double most = error(nodes, true);
    if (most <= wanted || (most <= 4 * wanted && error(nodes, false) <= wanted)) {
      nodes_ = nodes, single_near_ = most <= wanted;
      return;
    }
    // Each node an axis gains a factor of about six. What single precision cannot reach, the last order tries in
    // double.
    const int more = std::max(1, static_cast<int>(std::log(most / wanted) / std::log(6.0)));
    nodes = nodes < Chebyshev::kMost ? std::min(nodes + more, Chebyshev::kMost) : nodes + 1;
  }
  if (error(Chebyshev::kMost, false) <= wanted) nodes_ = Chebyshev::kMost;
}

void Evaluator::values(std::span<const Vec3> points, std::span<double> out) const {
  if (nodes_ == 0 || std::uint64_t{points.size()} * model_.centres.size() < kWorthFastSums)
    return evaluate(model_, points, out, threads_);
  const std::vector<std::size_t> near = nearPoints(model_, points);
  if (!near.empty()) {
    const std::vector<Vec3> at = relative(model_, points, near);
    std::vector<double> sums(at.size());
    FastSum(model_.centres, at, optionsOf(nodes_, single_near_, threads_, at.size())).values(model_.weights, sums);
    for (std::size_t n = 0; n < near.size(); ++n) out[near[n]] = finished(model_, at[n], sums[n]);
  }
  const std::vector<std::size_t> far = others(points.size(), near);
  if (far.empty()) return;
  std::vector<double> s(far.size());
  evaluate(model_, chosenOf(points, far), s, threads_);
  for (std::size_t n = 0; n < far.size(); ++n) out[far[n]] = s[n];
}

void Evaluator::gradients(std::span<const Vec3> points, std::span<Vec3> out) const {
  if (nodes_ == 0 || std::uint64_t{points.size()} * model_.centres.size() < kWorthFastSums)
    return evaluateGradient(model_, points, out, threads_);
  const std::vector<std::size_t> near = nearPoints(model_, points);
  if (!near.empty()) {
    const std::vector<Vec3> at = relative(model_, points, near);
    std::vector<Vec3> slopes(at.size());
    const FastSum sum(model_.centres, at, optionsOf(nodes_, single_near_, threads_, at.size()));
    sum.gradients(model_.weights, slopes);
    for (std::size_t n = 0; n < near.size(); ++n) out[near[n]] = slopes[n] + model_.linear;
    pointAwayBeyond(at, near, points, out);
  }
  const std::vector<std::size_t> far = others(points.size(), near);
  if (far.empty()) return;
  std::vector<Vec3> slopes(far.size());
  evaluateGradient(model_, chosenOf(points, far), slopes, threads_);
  for (std::size_t n = 0; n < far.size(); ++n) out[far[n]] = slopes[n];
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
