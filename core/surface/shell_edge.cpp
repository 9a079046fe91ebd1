#include "core/surface/shell_edge.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace spinaltap::surface {
namespace {

// Behind the cortex so much marrow is looked at; more would bring in its trabeculae and the far wall.
constexpr double kMarrow_mm = 2.0;
constexpr double kTissue_blurs = 3.0;
// A rise beyond the edge by more than this is the next structure (a facet joint's other side, the far wall).
constexpr double kRise_hu = 50;
// Weights of what is known beforehand against the profile, in HU. Neighbouring HU of a profile share voxels, so each
// counts for less than the noise alone would let it.
constexpr double kProfileError_hu = 60;
constexpr double kMarrowSpread_hu = 300;
constexpr double kThicknessSpread_mm = 3.0;
constexpr double kLeastThickness_mm = 0.05, kMostThickness_mm = 6.0;
constexpr double kLeastBlur_mm = 0.1, kMostBlur_mm = 4.0;
constexpr int kRounds = 12, kDampings = 6;
constexpr double kSettled_mm = 1e-3;

/// Edge, thickness, outside, inside, cortical HU, blur.
constexpr std::size_t kEdge = 0, kThickness = 1, kOutside = 2, kInside = 3, kCortical = 4, kBlur = 5, kCount = 6;
using Parameters = std::array<double, kCount>;

double cumulative(double z) { return 0.5 * std::erfc(-z * 0.7071067811865476); }
double density(double z) { return 0.3989422804014327 * std::exp(-0.5 * z * z); }

/// The part of the profile that belongs to this edge, and what can be read off it at once.
struct Window {
  std::size_t first = 0, last = 0;
  double peak_hu = 0, inside_hu = 0, outside_hu = 0, half_mm = 0;
};

/// The steepest fall over 0.3 mm either way, within the reach.
std::size_t steepestFall(const Profile& p, double reach_mm) {
  const auto lag = static_cast<std::size_t>(std::max(1L, std::lround(0.3 / p.step_mm)));
  const auto index = [&](double mm) { return static_cast<std::size_t>(std::lround((mm - p.first_mm) / p.step_mm)); };
  const std::size_t low = std::max(index(-reach_mm), lag);
  const std::size_t high = std::min(index(reach_mm), p.hu.size() - 1 - lag);
  std::size_t best = low;
  double fall = -1e9;
  for (std::size_t n = low; n <= high; ++n) {
    const double here = p.hu[n - lag] - p.hu[n + lag];
    if (here > fall) fall = here, best = n;
  }
  return best;
}

/// The lowest place from `start` on, at most `steps` away; a rise past it by kRise_hu ends the search.
/// @param way  +1 outwards, -1 inwards.
std::size_t lowestFrom(const Profile& p, std::size_t start, std::size_t steps, int way, std::size_t& reached) {
  std::size_t lowest = start, n = start;
  reached = start;
  for (std::size_t s = 0; s <= steps; ++s) {
    if (p.hu[n] < p.hu[lowest]) lowest = n;
    reached = n;
    if (p.hu[n] > p.hu[lowest] + kRise_hu) {
      reached = lowest;
      break;
    }
    if ((way < 0 && n == 0) || (way > 0 && n + 1 == p.hu.size())) break;
    n = way > 0 ? n + 1 : n - 1;
  }
  return lowest;
}

/// The cortex behind the edge: the highest place before the profile has fallen by a quarter.
std::size_t peakBehind(const Profile& p, std::size_t edge, std::size_t steps, double outside_hu) {
  std::size_t peak = edge;
  for (std::size_t s = 0; s <= steps && s <= edge; ++s) {
    const std::size_t n = edge - s;
    if (p.hu[n] > p.hu[peak]) peak = n;
    if (p.hu[n] < p.hu[peak] - 0.25 * (p.hu[peak] - outside_hu)) break;
  }
  return peak;
}

std::optional<Window> windowOf(const Profile& p, const EdgeQuery& q) {
  const auto steps = [&](double mm) { return static_cast<std::size_t>(std::ceil(mm / p.step_mm)); };
  const std::size_t edge = steepestFall(p, q.reach_mm);
  Window w;
  w.outside_hu = p.hu[lowestFrom(p, edge, steps(kTissue_blurs * q.blur_mm + 0.2), +1, w.last)];
  const std::size_t peak = peakBehind(p, edge, steps(1.0 + 3 * q.blur_mm), w.outside_hu);
  w.peak_hu = p.hu[peak];
  if (w.peak_hu - w.outside_hu < q.least_fall_hu) return std::nullopt;
  const auto room = std::max(0.0, std::min(kMarrow_mm + q.blur_mm, p.at_mm(peak) + q.most_inside_mm));
  w.inside_hu = p.hu[lowestFrom(p, peak, static_cast<std::size_t>(room / p.step_mm), -1, w.first)];
  const double level = 0.5 * (w.peak_hu + w.outside_hu);
  std::size_t n = peak;
  while (n + 1 < p.hu.size() && p.hu[n + 1] >= level) ++n;
  if (n + 1 >= p.hu.size()) return std::nullopt;
  w.half_mm = p.at_mm(n) + p.step_mm * (p.hu[n] - level) / (p.hu[n] - p.hu[n + 1]);
  if (std::abs(w.half_mm) > q.reach_mm) return std::nullopt;
  return w;
}

/// A step from outside to cortex at the edge, a step from cortex to marrow behind it, both blurred; a sum of squares
/// over the profile and over what is known beforehand, made least by Levenberg's and Marquardt's damping.
class ShellFit {
 public:
  ShellFit(const Profile& profile, const Window& window, const EdgeQuery& query)
      : profile_(profile), window_(window), query_(query), count_(query.free_blur ? kCount : kCount - 1) {
    const double cortical = std::max(query.cortical_hu, window.peak_hu);
    double area = 0;  // of the cortex over what surrounds it: the same however blurred it is
    for (std::size_t n = window.first; n <= window.last; ++n) {
      const double base = profile.at_mm(n) < window.half_mm ? window.inside_hu : window.outside_hu;
      area += std::max(0.0, profile.hu[n] - base) * profile.step_mm;
    }
    thickness_ = std::clamp(area / std::max(cortical - window.inside_hu, 100.0), 0.1, 5.0);
    now_ = {window.half_mm, thickness_, window.outside_hu, window.inside_hu, cortical, query.blur_mm};
  }

  Parameters run() {
    double cost = costOf(now_);
    double damping = 1e-3;
    for (int round = 0; round < kRounds; ++round) {
      linearise();
      bool better = false;
      double moved = 0;
      for (int trial = 0; trial < kDampings && !better; ++trial) {
        const Parameters next = stepped(damping);
        const double next_cost = costOf(next);
        better = next_cost < cost;
        damping *= better ? 0.2 : 6.0;
        if (better) moved = std::abs(next[kEdge] - now_[kEdge]), now_ = next, cost = next_cost;
      }
      if (!better || moved < kSettled_mm) break;
    }
    return now_;
  }

  [[nodiscard]] double misfit() const {
    double squares = 0;
    for (std::size_t n = window_.first; n <= window_.last; ++n) squares += std::pow(residual(now_, n), 2);
    return std::sqrt(squares / static_cast<double>(window_.last - window_.first + 1));
  }

 private:
  struct Prior {
    std::size_t which;
    double mean, spread;
  };
  [[nodiscard]] std::array<Prior, 3> priors() const {
    return {{{kCortical, query_.cortical_hu, query_.cortical_spread_hu},
             {kInside, window_.inside_hu, kMarrowSpread_hu},
             {kThickness, thickness_, kThicknessSpread_mm}}};
  }

  [[nodiscard]] double residual(const Parameters& p, std::size_t n) const {
    const double to_edge = p[kEdge] - profile_.at_mm(n);
    return p[kOutside] + (p[kCortical] - p[kOutside]) * cumulative(to_edge / p[kBlur]) +
           (p[kInside] - p[kCortical]) * cumulative((to_edge - p[kThickness]) / p[kBlur]) - profile_.hu[n];
  }

  [[nodiscard]] double costOf(const Parameters& p) const {
    double cost = 0;
    for (std::size_t n = window_.first; n <= window_.last; ++n) cost += std::pow(residual(p, n) / kProfileError_hu, 2);
    for (const Prior& prior : priors()) cost += std::pow((p[prior.which] - prior.mean) / prior.spread, 2);
    return cost;
  }

  void linearise() {
    normal_ = {};
    slope_ = {};
    const double rise = now_[kCortical] - now_[kOutside], fall = now_[kInside] - now_[kCortical], blur = now_[kBlur];
    for (std::size_t n = window_.first; n <= window_.last; ++n) {
      const double a = (now_[kEdge] - profile_.at_mm(n)) / blur, b = a - now_[kThickness] / blur;
      const double at_a = rise * density(a), at_b = fall * density(b), in_a = cumulative(a), in_b = cumulative(b);
      Parameters row{(at_a + at_b) / blur, -at_b / blur, 1 - in_a, in_b, in_a - in_b, -(at_a * a + at_b * b) / blur};
      const double r = (now_[kOutside] + rise * in_a + fall * in_b - profile_.hu[n]) / kProfileError_hu;
      for (std::size_t i = 0; i < count_; ++i) row[i] /= kProfileError_hu;
      for (std::size_t i = 0; i < count_; ++i) {
        slope_[i] += row[i] * r;
        for (std::size_t j = 0; j <= i; ++j) normal_[i][j] += row[i] * row[j];
      }
    }
    for (const Prior& prior : priors()) {
      slope_[prior.which] += (now_[prior.which] - prior.mean) / (prior.spread * prior.spread);
      normal_[prior.which][prior.which] += 1 / (prior.spread * prior.spread);
    }
  }

  /// Cholesky of the damped normal matrix; its diagonal is positive by the damping's floor.
  [[nodiscard]] Parameters stepped(double damping) const {
    std::array<Parameters, kCount> l{};
    Parameters y{};
    for (std::size_t i = 0; i < count_; ++i) {
      double rest = -slope_[i];
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = normal_[i][j] * (i == j ? 1 + damping : 1.0) + (i == j ? 1e-12 : 0.0);
        for (std::size_t k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
        l[i][j] = i == j ? std::sqrt(std::max(sum, 1e-15)) : sum / l[j][j];
        if (j < i) rest -= l[i][j] * y[j];
      }
      y[i] = rest / l[i][i];
    }
    Parameters next = now_;
    for (std::size_t i = count_; i-- > 0;) {
      for (std::size_t k = i + 1; k < count_; ++k) y[i] -= l[k][i] * y[k];
      y[i] /= l[i][i];
      next[i] += y[i];
    }
    next[kThickness] = std::clamp(next[kThickness], kLeastThickness_mm, kMostThickness_mm);
    next[kBlur] = std::clamp(next[kBlur], kLeastBlur_mm, kMostBlur_mm);
    return next;
  }

  const Profile& profile_;
  const Window& window_;
  const EdgeQuery& query_;
  std::size_t count_;
  double thickness_ = 0;
  Parameters now_{}, slope_{};
  std::array<Parameters, kCount> normal_{};  ///< lower triangle
};

}  // namespace

double plateauOf(const EdgeQuery& query) { return kMarrow_mm + 1.0 + (kTissue_blurs + 2) * query.blur_mm; }

std::optional<ShellEdge> findShellEdge(const Profile& profile, const EdgeQuery& query) {
  const auto window = windowOf(profile, query);
  if (!window) return std::nullopt;
  ShellFit fit(profile, *window, query);
  const Parameters p = fit.run();
  if (!(std::abs(p[kEdge]) <= query.reach_mm + query.blur_mm)) return std::nullopt;
  return ShellEdge{p[kEdge],     window->half_mm, p[kThickness], p[kOutside], p[kInside],
                   p[kCortical], window->peak_hu, p[kBlur],      fit.misfit()};
}

}  // namespace spinaltap::surface
