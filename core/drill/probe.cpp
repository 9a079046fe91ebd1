#include "core/drill/probe.h"

#include <algorithm>
#include <cmath>

#include "core/base/dmath.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;

// 2 - golden ratio (0.38197 turns), in parts of 2^20: neighbours in the order are far apart in angle.
constexpr int kTurn = 1 << 20, kGoldenAngle = 400520;

/// Round the axis, the i-th direction.
SinCos direction(std::size_t i) {
  return sinCosOfTurn(static_cast<int>((i * static_cast<std::size_t>(kGoldenAngle)) % kTurn), kTurn);
}

/// The direction of (x, y) in turns, 0 .. 1, to within 4e-9.
/// Coefficients: Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.49 (error of the arctangent 2e-8).
double roughTurn(double x, double y) {
  const double a = std::abs(x), b = std::abs(y), longer = std::max(a, b);
  if (!(longer > 0)) return 0;
  const double t = std::min(a, b) / longer, q = t * t;
  constexpr double kSeries[] = {0.0028662257, -0.0161657367, 0.0429096138, -0.0752896400, 0.1065626393, -0.1420889944,
                                0.1999355085, -0.3333314528, 1.0};
  double series = 0;
  for (const double next : kSeries) series = series * q + next;
  double turn = series * t * (0.5 / kPi);
  if (b > a) turn = 0.25 - turn;
  if (x < 0) turn = 0.5 - turn;
  if (y < 0) turn = 1.0 - turn;
  return turn;
}

// A place is at most half a spacing from its disc and half a spacing from its ring; on ring 1, whose slots are widest,
// half a spacing outward and half a slot on, that is sqrt(1.5^2 + 1 - 3 cos 30) = 0.81 spacings in the disc's plane and
// 0.95 in all. Slots near a boundary may be told apart wrongly by 4e-9 turns, which is less than what 0.95 was rounded.
struct Nearest {
  const point_volume::PointVolume& volume;
  double per_mm;

  explicit Nearest(const point_volume::PointVolume& v) : volume(v), per_mm(1.0 / v.lattice.spacing_mm) {}

  [[nodiscard]] std::uint16_t density(const Vec3& place_mm) const {
    const Lattice& lattice = volume.lattice;
    // Above zero a cast is the floor, which would be a call.
    const double disc = place_mm.z * per_mm - lattice.first_disc + 0.5;
    if (!(disc >= 0 && disc < lattice.discs)) return 0;
    const double out = std::sqrt(place_mm.x * place_mm.x + place_mm.y * place_mm.y) * per_mm + 0.5;
    if (!(out < lattice.rings)) return 0;
    const int ring = static_cast<int>(out), slots = Lattice::slotsOf(ring);
    const double past = roughTurn(place_mm.x, place_mm.y) * slots + 0.5;
    const int slot = static_cast<int>(past);
    const std::uint32_t index = lattice.index({static_cast<int>(disc), ring, slot < slots ? slot : slot - slots});
    return volume.isAlive(index) ? volume.density_mg_cm3[index] : std::uint16_t{0};
  }
};

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
    directions_[i] = {static_cast<float>(at.cos), static_cast<float>(at.sin)};
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
  const Direction& at = directions_[i % kTipFacets];
  if (i >= kTipFacets) {
    const double part = (static_cast<double>(i - kTipFacets) + 0.5) / kShaftFacets;
    return {radius_mm_ + out_mm_, -cone_mm_ - shaft_mm_ * part, at.x, at.y};
  }
  const double across = radius_mm_ * std::sqrt((static_cast<double>(i) + 0.5) / kTipFacets);
  return {across + out_across_mm_, out_ahead_mm_ - across * cone_mm_ / radius_mm_, at.x, at.y};
}

double Probe::clearOfLattice_mm(const BitPose& pose) const {
  return std::max(0.0, norm(pose.tip_mm - middle_mm_) - near_mm_);
}

void Probe::look(const point_volume::PointVolume& volume, const BitPose& pose, const Vec3& x, const Vec3& y,
                 std::span<std::uint16_t> densities) const {
  const Nearest nearest(volume);
  for (std::size_t i = 0; i < std::min(count(), densities.size()); ++i) {
    const Facet at = facet(i);
    const Vec3 out = x * (at.out_x * at.across_mm) + y * (at.out_y * at.across_mm);
    densities[i] = nearest.density(pose.tip_mm + out + pose.axis * at.z_mm);
  }
}

}  // namespace spinaltap::drill
