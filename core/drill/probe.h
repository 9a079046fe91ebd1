// core/drill/probe.h - what bone lies just outside the bit: what it would meet if it moved on.
//
// The bit's surface is covered with facets, each a spacing of the lattice outside it. A place so far from a convex body
// has its nearest lattice point outside that body (no place is farther than 0.96 spacings from one, see probe.cpp), so
// in bone every facet meets an alive point, however freshly the bit has cut: what is met does not flicker with the
// lattice, as the count of removed points does.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/drill/engine.h"
#include "core/drill/predicate.h"

namespace spinaltap::drill {

/// A patch of the bit's surface in the tool's frame: origin at the tip, z along the axis of drilling (so behind the tip
/// z is negative), x and y turning with the axis.
struct Facet {
  double across_mm, z_mm;  ///< its place, a spacing outside the surface: so far from the axis, and along it
  double out_x, out_y;     ///< unit vector across the axis, outward, to a millionth
};

/// Of each facet of a kind.
struct FacetArea {
  double frontal_mm2 = 0;  ///< projected onto a plane across the axis
  double side_mm2 = 0;     ///< projected onto a plane along the axis, square to (out_x, out_y)
};

class Probe {
 public:
  static constexpr std::size_t kTipFacets = 64, kShaftFacets = kTipFacets, kMostFacets = kTipFacets + kShaftFacets;

  /// @pre both are valid. The tip's facets have equal frontal areas, the shaft's equal areas; both wind about the axis
  /// by the golden angle, so that no direction and no depth is met by many at once.
  Probe(const point_volume::Lattice& lattice, const plan::Bit& bit);

  /// The tip's first, from the apex outward; then the shaft's, from the cone backward. @pre i < count().
  [[nodiscard]] Facet facet(std::size_t i) const;
  [[nodiscard]] std::size_t count() const { return shaft_mm_ > 0 ? kMostFacets : kTipFacets; }
  [[nodiscard]] const FacetArea& areaOf(std::size_t i) const { return i < kTipFacets ? of_tip_ : of_shaft_; }

  /// The density of the point nearest to each facet; 0 where that one is removed or none is.
  /// + - * / and sqrt only; does not allocate. @pre as Engine::step; x and y are the tool's, in the path frame;
  /// densities shorter than count() leave the last facets out.
  void look(const point_volume::PointVolume& volume, const BitPose& pose, const Vec3& x, const Vec3& y,
            std::span<std::uint16_t> densities) const;

  /// True when the bit is too far from the lattice to meet anything, by so many mm at least; 0 when it is not.
  [[nodiscard]] double clearOfLattice_mm(const BitPose& pose) const;

 private:
  using Places = std::array<double, kMostFacets>;
  /// The facets' places, tool frame.
  void place(Places& x_mm, Places& y_mm, Places& z_mm, bool with_shaft) const;

  std::array<float, kTipFacets> out_x_, out_y_;  ///< of the tip's facets, and again of the shaft's
  double radius_mm_, cone_mm_, shaft_mm_, out_mm_;
  double out_across_mm_ = 0, out_ahead_mm_ = 0;  ///< of the way out along the cone's normal
  FacetArea of_tip_, of_shaft_;
  Vec3 middle_mm_;
  double near_mm_;  ///< a tip farther from the middle than that meets nothing
};

/// True when an alive point is inside the bit, as the predicate says: where a bit that does not turn can't be.
/// @cost microseconds in the open, tens where much bone is near. @pre as Engine::step.
[[nodiscard]] bool meetsAlive(const point_volume::PointVolume& volume, const BitShape& bit, const BitPose& pose);

}  // namespace spinaltap::drill
