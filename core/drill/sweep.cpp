#include "core/drill/sweep.h"

#include <algorithm>
#include <cmath>

namespace spinaltap::drill {
namespace {

constexpr double kRounding = 1e-9;  // of a cut's motion

/// A direction square to another.
Vec3 squareTo(const Vec3& axis) {
  return normalized(cross(axis, std::abs(axis.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0}));
}

Vec3 turned(const Vec3& from, const Vec3& to, double part) {
  if (dot(from, to) > -0.99) return normalized(from + (to - from) * part);
  const Vec3 half_way = squareTo(from);
  return part < 0.5 ? normalized(from + (half_way - from) * (2 * part))
                    : normalized(half_way + (to - half_way) * (2 * part - 1));
}

}  // namespace

Sweep::Sweep(const point_volume::Lattice& lattice, const plan::Bit& bit)
    : longest_mm_(2 * kSurvival * lattice.spacing_mm),
      reach_mm_(std::sqrt(bit.length_mm * bit.length_mm + 0.25 * bit.diameter_mm * bit.diameter_mm)),
      middle_mm_{0, 0, 0.5 * (lattice.discZ_mm(0) + lattice.discZ_mm(lattice.discs - 1))} {
  const double half_mm = lattice.discZ_mm(lattice.discs - 1) - middle_mm_.z;
  const double radius_mm = lattice.rings * lattice.spacing_mm;
  near_mm_ = std::sqrt(half_mm * half_mm + radius_mm * radius_mm) + reach_mm_ + longest_mm_;
}

bool Sweep::add(const BitPose& pose, bool cutting) {
  if (count_ == kMostPoses) return false;
  waiting_[(first_ + count_++) % kMostPoses] = {pose, cutting};
  return true;
}

double Sweep::motion_mm(const BitPose& from, const BitPose& to) const {
  // Turning about the tip moves a point by the axis's chord times its distance from the tip.
  return norm(to.tip_mm - from.tip_mm) + reach_mm_ * norm(to.axis - from.axis);
}

BitPose Sweep::poseAt(const BitPose& to, double part) const {
  const BitPose& from = here_->pose;
  return {from.tip_mm + (to.tip_mm - from.tip_mm) * part, turned(from.axis, to.axis, part)};
}

double Sweep::partOfReach(const BitPose& to, double part) const {
  // |from + part * way - middle| = near, the smaller solution.
  const Vec3 way = to.tip_mm - here_->pose.tip_mm, from = here_->pose.tip_mm - middle_mm_;
  const double a = dot(way, way), b = dot(from, way), c = dot(from, from) - near_mm_ * near_mm_;
  const Vec3 now = from + way * part;
  const double inside = near_mm_ + longest_mm_;  // more than where it came in, so that rounding can't put it out again
  if (dot(now, now) <= inside * inside) return part;
  const double root = b * b - a * c;
  if (!(root > 0) || b >= 0) return 1.0;
  const double entry = (-b - std::sqrt(root)) / a;
  return entry > part && entry < 1.0 ? entry : 1.0;
}

double Sweep::nextPart(const BitPose& to) const {
  const double reached = partOfReach(to, part_);
  if (reached > part_) return reached;
  const BitPose now = poseAt(to, part_);
  const double left = motion_mm(now, to);
  if (left <= longest_mm_ * (1 + kRounding)) return 1.0;
  for (double step = (1.0 - part_) / std::ceil(left / longest_mm_ - kRounding);; step *= 0.5) {
    const double part = part_ + step;  // halved where the end of the axis hurries along its chord
    if (motion_mm(now, poseAt(to, part)) <= longest_mm_ * (1 + kRounding)) return part;
  }
}

std::optional<BitPose> Sweep::next() {
  while (count_ != 0) {
    const Target& target = waiting_[first_];
    if (here_ && here_->cutting && target.cutting) {
      part_ = nextPart(target.pose);
      if (part_ < 1.0) return poseAt(target.pose, part_);
    }
    here_ = target;
    part_ = 0;
    first_ = (first_ + 1) % kMostPoses;
    --count_;
    if (here_->cutting) return here_->pose;
  }
  return std::nullopt;
}

}  // namespace spinaltap::drill
