#include "core/rbf/reduce.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>

#include "core/rbf/subdomains.h"

namespace spinaltap::rbf {
namespace {

constexpr double kFirstShare = 12;  // one point in so many to begin with
// Each round adds at most this share of the centres so far: more would crowd around one bad spot, less costs rounds.
constexpr double kGrowth = 0.6;
constexpr double kFew = 0.01, kNearly = 0.9;
// Centres are solved for more closely than the reduction asks, so that what is missed is missed for want of centres; as
// long as much is missed, that need not be so close.
constexpr double kSolveShare = 0.25, kFirstSolveShare = 0.5;

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

/// The reduced fit minus the values.
std::vector<double> missed(std::span<const Vec3> points, std::span<const double> values,
                           const std::vector<Vec3>& centres, const SystemSolution& s, double tolerance,
                           unsigned threads) {
  FastSumOptions options;
  options.threads = threads;
  options.weights = s.weights, options.error = 0.1 * tolerance, options.single_error = 0.1 * tolerance;
  const FastSum sum(centres, points, options);
  std::vector<double> out(points.size());
  sum.values(s.weights, out);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Vec3& p = points[i];
    out[i] =
        -out[i] + s.polynomial[0] + s.polynomial[1] * p.x + s.polynomial[2] * p.y + s.polynomial[3] * p.z - values[i];
  }
  return out;
}

/// The next centres: the worst points beyond the tolerance that do not crowd each other.
std::vector<std::uint32_t> worst(std::span<const Vec3> points, const std::vector<double>& errors,
                                 const std::vector<std::uint8_t>& taken, double tolerance, std::size_t centres) {
  const auto beyond = [&](double limit) {
    std::vector<std::uint32_t> out;
    for (std::size_t i = 0; i < errors.size(); ++i) {
      if (taken[i] == 0 && std::abs(errors[i]) > limit) out.push_back(static_cast<std::uint32_t>(i));
    }
    return out;
  };
  std::vector<std::uint32_t> order = beyond(tolerance);
  // Few are left: those that are nearly beyond would be next, at the cost of a round for some of them each.
  if (!order.empty() && order.size() < kFew * static_cast<double>(centres)) order = beyond(kNearly * tolerance);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const double ea = std::abs(errors[a]), eb = std::abs(errors[b]);
    return ea != eb ? ea > eb : a < b;
  });
  const double n = static_cast<double>(centres);
  const std::size_t wanted = static_cast<std::size_t>(std::ceil(kGrowth * n));
  // n centres spread over a surface of about the set's size (1) squared are about this far apart.
  Spacing spacing(0.4 / std::sqrt(n));
  std::vector<std::uint32_t> out;
  for (const std::uint32_t i : order) {
    if (out.size() == wanted) break;
    if (spacing.take(points[i])) out.push_back(i);
  }
  return out;
}

}  // namespace

Result<Reduced> reduce(std::span<const Vec3> points, std::span<const double> values, double tolerance, unsigned threads,
                       const std::function<void(double)>& progress) {
  Reduced out;
  out.centres = thinOut(points, cutIntoSubdomains(points, 200, 200), kFirstShare);
  std::vector<std::uint8_t> taken(points.size(), 0);
  for (const std::uint32_t i : out.centres) taken[i] = 1;
  double first = 0, share = kFirstSolveShare;
  while (true) {
    std::vector<Vec3> centres;
    std::vector<double> wanted;
    for (const std::uint32_t i : out.centres) centres.push_back(points[i]), wanted.push_back(values[i]);
    const auto system = System::make(centres, 0, threads);
    if (!system) return tl::unexpected(system.error());
    out.solution = system->solve(wanted, share * tolerance, {}, out.solution.order);
    const std::vector<double> errors = missed(points, values, centres, out.solution, tolerance, threads);
    out.largest = 0;
    for (const double e : errors) out.largest = std::max(out.largest, std::abs(e));
    first = std::max(first, out.largest);
    if (out.largest <= tolerance && share == kSolveShare) return out;
    if (out.largest <= 2 * tolerance) share = kSolveShare;
    if (out.largest <= tolerance) continue;
    if (progress) progress(std::clamp(std::log(first / out.largest) / std::log(first / tolerance), 0.0, 1.0));
    const std::vector<std::uint32_t> more = worst(points, errors, taken, tolerance, out.centres.size());
    if (more.empty()) {
      return fail(ErrorCode::NotConverged,
                  "reduction: every sample is a centre and the largest error is still " + std::to_string(out.largest));
    }
    for (const std::uint32_t i : more) out.centres.push_back(i), taken[i] = 1;
  }
}

}  // namespace spinaltap::rbf
