#include "core/tradeoff/swept_volume.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/dmath.h"
#include "core/base/parallel.h"
#include "core/base/random.h"

namespace spinaltap::tradeoff {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Of a line; empty when `from` is not below `to`.
struct Stretch {
  double from = 0, to = 0;
  [[nodiscard]] bool empty() const { return !(from < to); }
};

Stretch both(const Stretch& a, const Stretch& b) { return {std::max(a.from, b.from), std::min(a.to, b.to)}; }

/// Where square * s^2 + 2 * half * s + rest <= 0, if it is one stretch: square >= 0, or s is kept to one nappe of a
/// cone (rest >= 0 > square), whose stretch begins at the positive root. Roots are taken without cancellation.
Stretch notPositive(double square, double half, double rest) {
  const double inner = half * half - square * rest;
  if (!(inner >= 0)) return {};
  const double root = std::sqrt(inner);
  if (square < 0) return {half > 0 ? (half + root) / -square : rest / (root - half), kInfinity};
  if (square == 0 && half == 0) return rest <= 0 ? Stretch{-kInfinity, kInfinity} : Stretch{};
  // The root of the larger size first, the other from their product.
  const double far = half > 0 ? -(half + root) : root - half;
  if (square == 0) return half > 0 ? Stretch{-kInfinity, rest / far} : Stretch{rest / far, kInfinity};
  const double one = far / square, other = far == 0 ? 0 : rest / far;
  return {std::min(one, other), std::max(one, other)};
}

/// A bit as vertical lines meet it. On one of them, s is the way up the shaft from the tip, and
/// z = tip.z - (s + q) / axis.z with q = d . axis, d from the tip to the line, across z.
class Meeting {
 public:
  Meeting(const plan::Bit& bit, const drill::BitPose& pose)
      : tip_(pose.tip_mm), axis_(pose.axis), rise_(1 / pose.axis.z), bit_(bit), radius_(0.5 * bit.diameter_mm) {
    // 1 / z^2 - 1 as tan^2 of the tilt: without cancellation, and 0 for an upright bit.
    slant_ = (axis_.x * axis_.x + axis_.y * axis_.y) * rise_ * rise_;
    slope_ = bit.cone_length_mm > 0 ? radius_ / bit.cone_length_mm : 0;
  }

  /// From the least z to the greatest.
  [[nodiscard]] Stretch on(double x, double y) const {
    const double dx = x - tip_.x, dy = y - tip_.y, q = dx * axis_.x + dy * axis_.y;
    const double half = q * rise_ * rise_,
                 rest = dx * dx + dy * dy + q * half;  // |radial|^2 = slant s^2 + 2 half s + rest
    Stretch up = both(notPositive(slant_, half, rest - radius_ * radius_), {bit_.cone_length_mm, bit_.length_mm});
    if (bit_.cone_length_mm > 0) {
      const Stretch cone = both(notPositive(slant_ - slope_ * slope_, half, rest), {0, bit_.cone_length_mm});
      // The bit is convex: what is in the cone and what is in the shaft touch.
      if (!cone.empty()) up = up.empty() ? cone : Stretch{cone.from, up.to};
    }
    if (up.empty()) return {};
    return {tip_.z - (up.to + q) * rise_, tip_.z - (up.from + q) * rise_};
  }

 private:
  Vec3 tip_, axis_;
  double rise_;
  plan::Bit bit_;
  double radius_, slant_ = 0, slope_ = 0;
};

/// What is covered of one column.
class Covered {
 public:
  void clear() { parts_.clear(); }
  /// @return how much of it was not.
  double add(Stretch s) {
    double gained = s.to - s.from;
    std::size_t kept = 0;
    for (const Stretch& part : parts_) {
      if (part.to < s.from || s.to < part.from) {
        parts_[kept++] = part;
        continue;
      }
      gained -= std::min(part.to, s.to) - std::max(part.from, s.from);
      s = {std::min(part.from, s.from), std::max(part.to, s.to)};
    }
    parts_.resize(kept);
    parts_.push_back(s);
    return std::max(0.0, gained);
  }

 private:
  std::vector<Stretch> parts_;  ///< apart from each other, in no order; hardly ever more than three
};

/// A Fibonacci number of at least `count`, and the one before it.
std::pair<int, int> fibonacci(int count) {
  int before = 1, now = 2;
  while (now < count) before = std::exchange(now, now + before);
  return {now, before};
}

double fraction(double x) { return x - std::floor(x); }

/// One estimate: what each pose covers newly, mm^3, added up over its columns.
std::vector<double> estimate(const std::vector<Meeting>& bits, double radius_mm, double top_mm, int columns,
                             Random random) {
  const auto [count, step] = fibonacci(columns);
  const double shift = random.unit(), turn = random.unit();
  const double share_mm2 = kPi * radius_mm * radius_mm / count;
  std::vector<double> each(bits.size(), 0.0);
  Covered covered;
  for (int n = 0; n < count; ++n) {
    const double folded = 1 - std::abs(2 * fraction(static_cast<double>(n) / count + shift) - 1);
    const double angle = fraction(fraction(static_cast<double>(n) * step / count) + turn);
    const double r = radius_mm * std::sqrt(folded);
    const SinCos direction = sinCos(2 * kPi * angle);
    const double x = r * direction.cos, y = r * direction.sin;
    covered.clear();
    for (std::size_t pose = 0; pose < bits.size(); ++pose) {
      const Stretch below = both(bits[pose].on(x, y), {top_mm, kInfinity});
      if (!below.empty()) each[pose] += covered.add(below) * share_mm2;
    }
  }
  return each;
}

}  // namespace

Reach reachOf(const plan::Bit& bit, std::span<const drill::BitPose> poses, double top_mm) {
  const double radius = 0.5 * bit.diameter_mm;
  Reach reach;
  for (const drill::BitPose& pose : poses) {
    const double lean = std::sqrt(pose.axis.x * pose.axis.x + pose.axis.y * pose.axis.y);
    // The highest place on the bit's axis whose circle still dips below the plane.
    const double up =
        std::clamp((pose.tip_mm.z + radius * lean - top_mm) / pose.axis.z, 0.0, std::max(0.0, bit.length_mm));
    const Vec3 high = pose.tip_mm - pose.axis * up;
    const double off = std::max(std::hypot(pose.tip_mm.x, pose.tip_mm.y), std::hypot(high.x, high.y));
    reach.radius_mm = std::max(reach.radius_mm, off + radius);
    // Of the tip and the rim where the cone ends.
    const double rim = pose.tip_mm.z - bit.cone_length_mm * pose.axis.z + radius * lean;
    reach.depth_mm = std::max({reach.depth_mm, pose.tip_mm.z - top_mm, rim - top_mm});
  }
  return reach;
}

Swept sweptVolume(const plan::Bit& bit, std::span<const drill::BitPose> poses, double top_mm,
                  const SweptOptions& options) {
  assert(!poses.empty() && options.estimates >= 2);
  const double radius_mm = reachOf(bit, poses, top_mm).radius_mm;
  std::vector<Meeting> bits;
  bits.reserve(poses.size());
  for (const drill::BitPose& pose : poses) bits.emplace_back(bit, pose);
  const auto count = static_cast<std::size_t>(options.estimates);
  std::vector<std::vector<double>> estimates(count);
  parallelBlocks(count, 1, options.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e)
      estimates[e] = estimate(bits, radius_mm, top_mm, options.columns, Random(mix64(options.seed + e)));
  });

  Swept out;
  out.each_mm3.assign(poses.size(), 0.0);
  std::vector<double> totals(count, 0.0);
  const auto estimated = static_cast<double>(count);
  double squares = 0;
  for (std::size_t pose = 0; pose < poses.size(); ++pose) {
    double& mean = out.each_mm3[pose];
    for (std::size_t e = 0; e < count; ++e) mean += estimates[e][pose] / estimated, totals[e] += estimates[e][pose];
    for (const auto& e : estimates) squares += (e[pose] - mean) * (e[pose] - mean);
    out.total_mm3 += mean;
  }
  // Of a mean of n independent estimates: their spread over the root of n.
  const double freedom = estimated * (estimated - 1);
  out.each_error_mm3 = std::sqrt(squares / freedom / static_cast<double>(poses.size()));
  for (const double total : totals) out.error_mm3 += (total - out.total_mm3) * (total - out.total_mm3);
  out.error_mm3 = std::sqrt(out.error_mm3 / freedom);
  return out;
}

}  // namespace spinaltap::tradeoff
