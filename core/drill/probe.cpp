#include "core/drill/probe.h"

#include <algorithm>
#include <cmath>

#include "core/base/dmath.h"
#include "core/drill/simd_probe.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;

// 2 - golden ratio (0.38197 turns), in parts of 2^20: neighbours in the order are far apart in angle.
constexpr int kTurn = 1 << 20, kGoldenAngle = 400520;

/// Round the axis, the i-th direction.
SinCos direction(std::size_t i) {
  return sinCosOfTurn(static_cast<int>((i * static_cast<std::size_t>(kGoldenAngle)) % kTurn), kTurn);
}

}  // namespace

Probe::Probe(const Lattice& lattice, const plan::Bit& bit)
    : radius_mm_(bit.diameter_mm / 2),
      cone_mm_(bit.cone_length_mm),
      shaft_mm_(bit.length_mm - bit.cone_length_mm),
      out_mm_(lattice.spacing_mm) {
  const double slant = std::sqrt(radius_mm_ * radius_mm_ + cone_mm_ * cone_mm_);
  out_across_mm_ = out_mm_ * cone_mm_ / slant, out_ahead_mm_ = out_mm_ * radius_mm_ / slant;
  for (std::size_t i = 0; i < kTipFacets; ++i) {
    const SinCos at = direction(i);
    out_x_[i] = static_cast<float>(at.cos), out_y_[i] = static_cast<float>(at.sin);
  }
  const double each = kPi * radius_mm_ * radius_mm_ / kTipFacets;
  of_tip_ = {each, each * cone_mm_ / radius_mm_};
  of_shaft_.side_mm2 = 2 * kPi * radius_mm_ * shaft_mm_ / kShaftFacets;
  const double half = 0.5 * lattice.spacing_mm * (lattice.discs - 1), wide = lattice.rings * lattice.spacing_mm;
  middle_mm_ = {0, 0, lattice.discZ_mm(0) + half};
  near_mm_ = std::sqrt(half * half + wide * wide) + std::sqrt(bit.length_mm * bit.length_mm + radius_mm_ * radius_mm_) +
             2 * out_mm_;
}

Facet Probe::facet(std::size_t i) const {
  const double out_x = out_x_[i % kTipFacets], out_y = out_y_[i % kTipFacets];
  if (i >= kTipFacets) {
    const double part = (static_cast<double>(i - kTipFacets) + 0.5) / kShaftFacets;
    return {radius_mm_ + out_mm_, -cone_mm_ - shaft_mm_ * part, out_x, out_y};
  }
  const double across = radius_mm_ * std::sqrt((static_cast<double>(i) + 0.5) / kTipFacets);
  return {across + out_across_mm_, out_ahead_mm_ - across * cone_mm_ / radius_mm_, out_x, out_y};
}

double Probe::clearOfLattice_mm(const BitPose& pose) const {
  return std::max(0.0, norm(pose.tip_mm - middle_mm_) - near_mm_);
}

// As facet(), in loops that compilers turn into vectors. Kept in memory they would take as much as all else that a
// session has beside its volume and its engine.
void Probe::place(Places& x_mm, Places& y_mm, Places& z_mm, bool with_shaft) const {
  for (int i = 0; i < static_cast<int>(kTipFacets); ++i) {
    const double across = radius_mm_ * std::sqrt((i + 0.5) / kTipFacets), out = across + out_across_mm_;
    x_mm[i] = out_x_[i] * out, y_mm[i] = out_y_[i] * out;
    z_mm[i] = out_ahead_mm_ - across * cone_mm_ / radius_mm_;
  }
  if (!with_shaft) return;
  for (int i = 0; i < static_cast<int>(kShaftFacets); ++i) {
    const std::size_t at = kTipFacets + static_cast<std::size_t>(i);
    x_mm[at] = out_x_[i] * (radius_mm_ + out_mm_), y_mm[at] = out_y_[i] * (radius_mm_ + out_mm_);
    z_mm[at] = -cone_mm_ - shaft_mm_ * ((i + 0.5) / kShaftFacets);
  }
}

// A place is at most half a spacing from its disc and half a spacing from its ring; on ring 1, whose slots are widest,
// half a spacing outward and half a slot on, that is sqrt(1.5^2 + 1 - 3 cos 30) = 0.81 spacings in the disc's plane and
// 0.95 in all. Slots near a boundary may be told apart wrongly by 4e-9 turns, which is less than what 0.95 was rounded.
void Probe::look(const point_volume::PointVolume& volume, const BitPose& pose, const Vec3& x, const Vec3& y,
                 std::span<std::uint16_t> densities) const {
  const std::size_t looks = std::min(count(), densities.size());
  Places x_mm, y_mm, z_mm;
  place(x_mm, y_mm, z_mm, looks > kTipFacets);
  std::array<std::uint32_t, kMostFacets> nearest;
  nearestPoints(volume.lattice, {pose.tip_mm, x, y, pose.axis}, {x_mm.data(), y_mm.data(), z_mm.data()}, looks,
                nearest.data());
  for (std::size_t i = 0; i < looks; ++i) {
    // Without a branch, which would be taken at random.
    const bool known = nearest[i] != kNoPoint;
    const std::uint32_t point = known ? nearest[i] : 0;
    const unsigned met = static_cast<unsigned>(known) & static_cast<unsigned>(volume.isAlive(point));
    densities[i] = static_cast<std::uint16_t>(volume.density_mg_cm3[point] * met);
  }
}

}  // namespace spinaltap::drill
