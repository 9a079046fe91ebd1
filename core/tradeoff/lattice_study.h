// core/tradeoff/lattice_study.h - how evenly the points of a volume are spread, and how unevenly a bit that moves
// evenly meets them, for several ways of turning and shifting the rings. After: R. Schmidt, "SpinalTap" (2002),
// section 6.4, which gives the distance of neighbours on a ring and leaves all others open.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/plan/path.h"
#include "core/point_volume/lattice.h"

namespace spinaltap::tradeoff {

enum class Phase {
  Aligned,         ///< as point_volume has it: slot 0 of every ring on +x
  GoldenRing,      ///< ring k turned by k golden angles
  GoldenRingDisc,  ///< ring k of disc d turned by k + d golden angles
  Staggered,  ///< turned by shares of a slot, as even in ring and disc as may be: the sequence of the plastic number
  Screw,      ///< turned as GoldenRing, and each ring one turn of a screw that climbs a spacing
  JitterQuarter,  ///< aligned, each point moved by up to a quarter of the spacing along each axis, at random
  JitterHalf,     ///< by up to half of it: anywhere in its own cell
};
inline constexpr std::array kPhases{Phase::Aligned, Phase::GoldenRing,    Phase::GoldenRingDisc, Phase::Staggered,
                                    Phase::Screw,   Phase::JitterQuarter, Phase::JitterHalf};
[[nodiscard]] std::string_view nameOf(Phase phase);

/// Path frame, mm. The same every time, jitter too. @pre the site is in the lattice.
[[nodiscard]] Vec3 positionOf(const point_volume::Lattice& lattice, const point_volume::Site& site, Phase phase);
/// All of them, in index order.
[[nodiscard]] std::vector<Vec3> positionsOf(const point_volume::Lattice& lattice, Phase phase);

/// Distances to the nearest neighbour, in spacings.
struct Spread {
  double least = 0, mean = 0, most = 0;
};
struct Neighbours {
  Spread in_ring;       ///< on a point's own ring
  Spread across_rings;  ///< on the rings next to it, on its disc
  Spread across_discs;  ///< on the discs next to it
};
/// Of every point that has rings and discs on both sides, the centre points left out.
/// @pre at least 3 rings and 3 discs. @cost some microseconds a point.
[[nodiscard]] Neighbours neighboursOf(const point_volume::Lattice& lattice, Phase phase);

/// Points times pointVolume_mm3 over the volume that they were counted in: 1 is what haptics and metrics reckon with.
struct Share {
  double mean = 0;
  double deviation = 0;  ///< standard deviation over the mean
};

/// In balls of this radius, their middles at random wherever a whole ball lies among the points.
/// @pre the lattice is wider and longer than a ball; balls > 0.
[[nodiscard]] Share densityOf(const point_volume::Lattice& lattice, Phase phase, double radius_mm, int balls,
                              std::uint64_t seed);

/// A bit moved by one step a cycle, straight on or straight sideways.
struct Motion {
  Vec3 tip_mm;     ///< path frame, in cycle 0
  Vec3 axis;       ///< unit, from the shaft to the tip
  Vec3 step_mm;    ///< each cycle's: along the axis, or perpendicular to it
  int cycles = 1;  ///< 1 .. cycles are counted; what cycle 0 finds inside is gone before
};

/// How many points each of the cycles 1 .. motion.cycles removes: those inside the bit then and in no cycle before.
/// @pre the step is along the axis (and forwards) or perpendicular to it, and not 0. @cost some 20 ns a point.
[[nodiscard]] std::vector<std::uint32_t> removedPerCycle(const std::vector<Vec3>& points, const plan::Bit& bit,
                                                         const Motion& motion);

/// What the bit newly covers in a cycle: its section times a step along its axis; its silhouette times one sideways.
[[nodiscard]] double sweptPerCycle_mm3(const plan::Bit& bit, const Motion& motion);

/// Of values that should all be 1, one a cycle; with `smoothing_cycles`, after a low-pass of one pole that begins at 1.
/// @pre at least one value.
[[nodiscard]] Share rippleOf(std::span<const double> shares, double smoothing_cycles = 0);

/// Points removed a cycle against the volume swept; with `smoothing_cycles`, after a low-pass of one pole, as thrust
/// is.
/// @param point_mm3 what a point stands for.
/// @pre as removedPerCycle; nothing but the shaft, moved along its axis, leaves the points' lattice during the motion.
[[nodiscard]] Share rippleOf(const std::vector<Vec3>& points, double point_mm3, const plan::Bit& bit,
                             const Motion& motion, double smoothing_cycles = 0);

/// The motions that the phases are compared by, in a lattice of 0.1 mm that holds them.
struct NamedMotion {
  std::string_view name;
  plan::Bit bit;
  Motion motion;
};
[[nodiscard]] point_volume::Lattice motionLattice();
/// Over 1 mm each, in steps of this length: along the path, beside it and tilted, and sideways, straight and tilted.
/// @pre 0 < step_mm <= 0.1.
[[nodiscard]] std::vector<NamedMotion> usualMotions(double step_mm);

}  // namespace spinaltap::tradeoff
