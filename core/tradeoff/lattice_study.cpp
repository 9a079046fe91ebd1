#include "core/tradeoff/lattice_study.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/dmath.h"
#include "core/base/hash.h"
#include "core/base/random.h"
#include "core/drill/predicate.h"

namespace spinaltap::tradeoff {
namespace {

using point_volume::Lattice;
using point_volume::Site;

constexpr double kGoldenTurn = 0.38196601125010515;  // 2 minus the golden ratio, of a turn
constexpr double kPlasticOne = 0.7548776662466927, kPlasticTwo = 0.5698402909980532;  // 1 / p, 1 / p^2; p^3 = p + 1

double fraction(double x) { return x - std::floor(x); }

/// How far a ring is turned, of a whole turn.
double turnOf(const Site& site, Phase phase) {
  switch (phase) {
    case Phase::GoldenRing:
    case Phase::Screw:
      return fraction(site.ring * kGoldenTurn);
    case Phase::GoldenRingDisc:
      return fraction((site.ring + site.disc) * kGoldenTurn);
    case Phase::Staggered:
      return fraction(site.ring * kPlasticOne + site.disc * kPlasticTwo) / Lattice::slotsOf(site.ring);
    default:
      return 0;
  }
}

/// How far along the path a point is shifted, in spacings: by its angle, so that what is beside it is beside it still.
double climbOf(double turn, const Site& site, Phase phase) {
  return phase == Phase::Screw ? fraction(turn + site.ring * kGoldenTurn) - 0.5 : 0.0;
}

double jitterOf(Phase phase) { return phase == Phase::JitterQuarter ? 0.25 : phase == Phase::JitterHalf ? 0.5 : 0.0; }

/// Points by cubes, so that whoever is near is found at once.
class Cubes {
 public:
  Cubes(const std::vector<Vec3>& points, double side) : points_(points), side_(side), low_(points[0]) {
    Vec3 high = low_;
    for (const Vec3& p : points) {
      low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y), std::min(low_.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    count_ = {along(high.x - low_.x) + 1, along(high.y - low_.y) + 1, along(high.z - low_.z) + 1};
    first_.assign(static_cast<std::size_t>(count_[0]) * static_cast<std::size_t>(count_[1]) *
                          static_cast<std::size_t>(count_[2]) +
                      1,
                  0);
    for (const Vec3& p : points) ++first_[cubeOf(p) + 1];
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    members_.resize(points.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t i = 0; i < points.size(); ++i) members_[next[cubeOf(points[i])]++] = i;
  }

  /// visit(index, squared distance) for all points within one side of p, and some beyond.
  template <class Visit>
  void near(const Vec3& p, const Visit& visit) const {
    const auto range = [&](double at, int axis) {
      const int middle = along(at);
      return std::array{std::max(0, middle - 1), std::min(count_[static_cast<std::size_t>(axis)] - 1, middle + 1)};
    };
    const auto x = range(p.x - low_.x, 0), y = range(p.y - low_.y, 1), z = range(p.z - low_.z, 2);
    for (int k = z[0]; k <= z[1]; ++k) {
      for (int j = y[0]; j <= y[1]; ++j) {
        for (int i = x[0]; i <= x[1]; ++i) {
          const std::size_t cube = cubeAt(i, j, k);
          for (std::uint32_t m = first_[cube]; m < first_[cube + 1]; ++m) {
            const Vec3 d = points_[members_[m]] - p;
            visit(members_[m], dot(d, d));
          }
        }
      }
    }
  }

 private:
  [[nodiscard]] int along(double from_low) const { return static_cast<int>(std::floor(from_low / side_)); }
  [[nodiscard]] std::size_t cubeAt(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(count_[0]) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(count_[1]) * static_cast<std::size_t>(k));
  }
  [[nodiscard]] std::size_t cubeOf(const Vec3& p) const {
    return cubeAt(along(p.x - low_.x), along(p.y - low_.y), along(p.z - low_.z));
  }

  const std::vector<Vec3>& points_;
  double side_;
  Vec3 low_;
  std::array<int, 3> count_{};
  std::vector<std::uint32_t> first_, members_;
};

/// Least, mean and most, of distances whose squares are given.
class Gather {
 public:
  void add(double squared) {
    const double distance = std::sqrt(squared);
    least_ = std::min(least_, distance), most_ = std::max(most_, distance), sum_ += distance, count_ += 1;
  }
  [[nodiscard]] Spread in(double spacing_mm) const {
    return {least_ / spacing_mm, sum_ / count_ / spacing_mm, most_ / spacing_mm};
  }

 private:
  double least_ = std::numeric_limits<double>::infinity(), most_ = 0, sum_ = 0, count_ = 0;
};

Share shareOf(const std::vector<double>& values) {
  double mean = 0, squares = 0;
  for (const double v : values) mean += v;
  mean /= static_cast<double>(values.size());
  for (const double v : values) squares += (v - mean) * (v - mean);
  return {mean, std::sqrt(squares / static_cast<double>(values.size())) / mean};
}

bool isSideways(const Motion& motion) {
  return std::abs(dot(motion.step_mm, motion.axis)) < 0.5 * norm(motion.step_mm);
}

/// About when the bit first holds the point, in cycles; infinity if it never does.
double entryOf(const Vec3& point, const plan::Bit& bit, const Motion& motion) {
  constexpr double never = std::numeric_limits<double>::infinity();
  const Vec3 from_tip = point - motion.tip_mm;
  const double behind = -dot(from_tip, motion.axis), radius = 0.5 * bit.diameter_mm, step = norm(motion.step_mm);
  const Vec3 radial = from_tip + motion.axis * behind;
  if (!isSideways(motion)) {
    const double off = norm(radial);
    if (off > radius + drill::kTouch_mm) return never;
    return (bit.cone_length_mm * off / radius - behind) / step;  // until the cone is as wide there
  }
  if (behind < -drill::kTouch_mm || behind > bit.length_mm + drill::kTouch_mm) return never;
  const double cone = behind >= bit.cone_length_mm ? radius : radius * std::max(0.0, behind) / bit.cone_length_mm;
  const double wide = cone + drill::kTouch_mm;
  const Vec3 ahead = motion.step_mm / step;
  const double along = dot(radial, ahead);
  const Vec3 beside = radial - ahead * along;
  const double chord = wide * wide - dot(beside, beside);
  return chord < 0 ? never : (along - std::sqrt(chord)) / step;
}

}  // namespace

std::string_view nameOf(Phase phase) {
  constexpr std::array<std::string_view, kPhases.size()> names{
      "aligned", "golden-ring", "golden-ring-disc", "staggered", "screw", "jitter-quarter", "jitter-half"};
  return names[static_cast<std::size_t>(phase)];
}

Vec3 positionOf(const Lattice& lattice, const Site& site, Phase phase) {
  const int slots = Lattice::slotsOf(site.ring);
  const double turn = fraction(turnOf(site, phase) + static_cast<double>(site.slot) / slots);
  const SinCos direction = sinCos(2 * kPi * turn);
  const double radius = site.ring * lattice.spacing_mm, jitter = jitterOf(phase) * lattice.spacing_mm;
  const double climb = climbOf(turn, site, phase) * lattice.spacing_mm;
  const Vec3 place{radius * direction.cos, radius * direction.sin, lattice.discZ_mm(site.disc) + climb};
  if (jitter == 0) return place;
  Random random(mix64(lattice.index(site)));
  // along the radius, along the ring, and along the path
  const double outward = random.uniform(-jitter, jitter), around = random.uniform(-jitter, jitter);
  return place + Vec3{outward * direction.cos - around * direction.sin,
                      outward * direction.sin + around * direction.cos, random.uniform(-jitter, jitter)};
}

std::vector<Vec3> positionsOf(const Lattice& lattice, Phase phase) {
  std::vector<Vec3> points;
  points.reserve(static_cast<std::size_t>(lattice.points()));
  for (std::uint32_t i = 0; i < lattice.points(); ++i) points.push_back(positionOf(lattice, lattice.site(i), phase));
  return points;
}

Neighbours neighboursOf(const Lattice& lattice, Phase phase) {
  const std::vector<Vec3> points = positionsOf(lattice, phase);
  // Nobody's nearest is farther: a spacing and half an arc away, and two jitters of half a spacing along each axis.
  const double reach = 3 * lattice.spacing_mm;
  const Cubes cubes(points, reach);
  Gather in_ring, across_rings, across_discs;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Site own = lattice.site(i);
    if (own.ring < 1 || own.ring > lattice.rings - 2 || own.disc < 1 || own.disc > lattice.discs - 2) continue;
    double ring = std::numeric_limits<double>::infinity(), rings = ring, discs = ring;
    cubes.near(points[i], [&](std::uint32_t other, double squared) {
      const Site site = lattice.site(other);
      const int apart = std::abs(site.ring - own.ring), up = std::abs(site.disc - own.disc);
      if (up == 0 && apart == 0 && other != i) ring = std::min(ring, squared);
      if (up == 0 && apart == 1) rings = std::min(rings, squared);
      if (up == 1) discs = std::min(discs, squared);
    });
    in_ring.add(ring), across_rings.add(rings), across_discs.add(discs);
  }
  return {in_ring.in(lattice.spacing_mm), across_rings.in(lattice.spacing_mm), across_discs.in(lattice.spacing_mm)};
}

Share densityOf(const Lattice& lattice, Phase phase, double radius_mm, int balls, std::uint64_t seed) {
  const std::vector<Vec3> points = positionsOf(lattice, phase);
  const Cubes cubes(points, radius_mm);
  const double wide = (lattice.rings - 1) * lattice.spacing_mm - radius_mm;
  const double low = lattice.discZ_mm(0) + radius_mm, high = lattice.discZ_mm(lattice.discs - 1) - radius_mm;
  const double share = point_volume::pointVolume_mm3(lattice) / (4.0 / 3.0 * kPi * radius_mm * radius_mm * radius_mm);
  Random random(seed);
  std::vector<double> shares;
  while (shares.size() < static_cast<std::size_t>(balls)) {
    const Vec3 middle{random.uniform(-wide, wide), random.uniform(-wide, wide), random.uniform(low, high)};
    if (middle.x * middle.x + middle.y * middle.y > wide * wide) continue;
    double inside = 0;
    cubes.near(middle, [&](std::uint32_t, double squared) { inside += squared <= radius_mm * radius_mm ? 1 : 0; });
    shares.push_back(inside * share);
  }
  return shareOf(shares);
}

std::vector<std::uint32_t> removedPerCycle(const std::vector<Vec3>& points, const plan::Bit& bit,
                                           const Motion& motion) {
  std::vector<std::uint32_t> removed(static_cast<std::size_t>(motion.cycles), 0);
  const drill::BitShape shape = drill::shapeOf(bit);
  const auto holds = [&](int cycle, const Vec3& point) {
    return drill::isInside(shape, motion.tip_mm + motion.step_mm * cycle, motion.axis, point);
  };
  for (const Vec3& point : points) {
    const double entry = entryOf(point, bit, motion);
    // The predicate decides; rounding and its touch may put the cycle beside the one that was reckoned.
    if (entry < -2 || entry > motion.cycles + 2 || holds(0, point)) continue;
    const int about = static_cast<int>(std::floor(entry));
    for (int cycle = std::max(1, about - 1); cycle <= std::min(motion.cycles, about + 2); ++cycle) {
      if (!holds(cycle, point)) continue;
      ++removed[static_cast<std::size_t>(cycle) - 1];
      break;
    }
  }
  return removed;
}

double sweptPerCycle_mm3(const plan::Bit& bit, const Motion& motion) {
  const double radius = 0.5 * bit.diameter_mm, step = norm(motion.step_mm);
  if (!isSideways(motion)) return kPi * radius * radius * step;
  return step * (bit.diameter_mm * (bit.length_mm - bit.cone_length_mm) + radius * bit.cone_length_mm);
}

Share rippleOf(std::span<const double> shares, double smoothing_cycles) {
  std::vector<double> smoothed;
  smoothed.reserve(shares.size());
  double smooth = 1;  // what an even removal would have it be
  for (const double share : shares) {
    smooth += (share - smooth) / (1 + smoothing_cycles);
    smoothed.push_back(smooth);
  }
  return shareOf(smoothed);
}

Share rippleOf(const std::vector<Vec3>& points, double point_mm3, const plan::Bit& bit, const Motion& motion,
               double smoothing_cycles) {
  const double share = point_mm3 / sweptPerCycle_mm3(bit, motion);
  std::vector<double> shares;
  for (const std::uint32_t removed : removedPerCycle(points, bit, motion)) shares.push_back(removed * share);
  return rippleOf(shares, smoothing_cycles);
}

Lattice motionLattice() { return {0.1, 36, 80, 0}; }

std::vector<NamedMotion> usualMotions(double step_mm) {
  const int cycles = std::max(1, static_cast<int>(std::lround(1 / step_mm)));
  const plan::Bit far{3.0, 5.0, 50.0}, whole{3.0, 5.0, 6.0};  // sideways, the whole bit is among the points
  const SinCos tilt = sinCos(2 * kPi / 180), slight = sinCos(0.5 * kPi / 180), way = sinCos(17 * kPi / 180);
  const Vec3 straight{0, 0, 1}, tilted{tilt.sin * way.cos, tilt.sin * way.sin, tilt.cos};
  const Vec3 nearly{slight.sin * way.cos, slight.sin * way.sin, slight.cos};
  const Vec3 beside{-way.sin, way.cos, 0};  // perpendicular to both
  // Tips begin off the lattice's planes, so that no ring is met at the very edge of a cycle.
  const Vec3 on{0, 0, 6.0137}, off{0.31, 0.17, 6.0137}, low{-0.2, 0.13, 6.7137};
  return {{"on the path", far, {on, straight, straight * step_mm, cycles}},
          {"10 um beside it", far, {on + Vec3{0.01, 0, 0}, straight, straight * step_mm, cycles}},
          {"0.35 mm beside it", far, {off, straight, straight * step_mm, cycles}},
          {"tilted 0.5 degrees", far, {off, nearly, nearly * step_mm, cycles}},
          {"tilted 2 degrees", far, {off, tilted, tilted * step_mm, cycles}},
          {"sideways", whole, {low, straight, Vec3{step_mm, 0, 0}, cycles}},
          {"sideways, tilted", whole, {low, tilted, beside * step_mm, cycles}}};
}

}  // namespace spinaltap::tradeoff
