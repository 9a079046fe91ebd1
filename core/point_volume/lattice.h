// core/point_volume/lattice.h - the cylinder of discs of rings of points, as integers.
// After: R. Schmidt, "SpinalTap: An Architecture For Real-Time Vertebrae Drilling Simulation" (2002), sections 6.2-6.4.
#pragma once
#include <cstdint>
#include <vector>

#include "core/base/result.h"
#include "core/base/vec3.h"
#include "core/plan/path.h"

namespace spinaltap::point_volume {

/// A point of the lattice: slot 0 .. 6*ring-1 on ring 1 .. rings-1 of a disc; ring 0 is the centre point alone.
struct Site {
  int disc = 0, ring = 0, slot = 0;
  friend bool operator==(const Site&, const Site&) = default;
};

/// Positions (path frame, mm): z = (first_disc + disc) * spacing; on its disc, radius ring * spacing at the angle
/// 2 pi slot / (6 ring), slot 0 on +x. Coordinates are derived from the integers, never stored.
struct Lattice {
  double spacing_mm = 0.1;
  int rings = 40;  ///< n: the centre and rings 1 .. n-1, so the outermost radius is (n-1) * spacing
  int discs = 100;
  int first_disc = 0;  ///< negative when the volume begins before the entry point

  /// 3n(n-1) + 1; the report's formula has the +1 misplaced, its figures do not.
  [[nodiscard]] std::uint32_t pointsPerDisc() const {
    return 3u * static_cast<std::uint32_t>(rings) * static_cast<std::uint32_t>(rings - 1) + 1u;
  }
  [[nodiscard]] std::uint64_t points() const {
    return static_cast<std::uint64_t>(pointsPerDisc()) * static_cast<std::uint64_t>(discs);
  }
  [[nodiscard]] static constexpr int slotsOf(int ring) { return ring == 0 ? 1 : 6 * ring; }
  /// Index of the first point of a ring within its disc: 0 for the centre, 3k(k-1)+1 for ring k.
  [[nodiscard]] static constexpr std::uint32_t ringStart(int ring) {
    return ring == 0 ? 0u : 3u * static_cast<std::uint32_t>(ring) * static_cast<std::uint32_t>(ring - 1) + 1u;
  }
  /// Disc by disc, ring by ring outward, slot by slot. @pre the site is in the lattice.
  [[nodiscard]] std::uint32_t index(const Site& site) const {
    return static_cast<std::uint32_t>(site.disc) * pointsPerDisc() + ringStart(site.ring) +
           static_cast<std::uint32_t>(site.slot);
  }
  [[nodiscard]] Site site(std::uint32_t index) const;
  [[nodiscard]] double discZ_mm(int disc) const { return static_cast<double>(first_disc + disc) * spacing_mm; }
  friend bool operator==(const Lattice&, const Lattice&) = default;
};

/// @error InvalidArgument, NotFinite, Limit (2^31 points or more, more than 10,000 rings).
[[nodiscard]] Result<void> checkLattice(const Lattice& lattice);

/// The lattice of a path: rings = round(volume radius / spacing), discs = round((lead + length) / spacing).
/// @pre checkPath(path).
[[nodiscard]] Lattice latticeOf(const plan::Path& path);

/// Every disc is the same: x and y (mm, path frame) of its points, in index order.
struct DiscTable {
  std::vector<double> x_mm, y_mm;  ///< #pointsPerDisc each
};
[[nodiscard]] DiscTable discTable(const Lattice& lattice);

/// One point, to the bits of discTable. @pre index < points().
[[nodiscard]] Vec3 positionOf(const Lattice& lattice, std::uint32_t index);

/// The bone that one point stands for: pi/3 * spacing^3, since ring k has 6k points on an annulus of area
/// 2 pi k spacing^2 (the centre point's share, pi/4, is counted alike).
[[nodiscard]] double pointVolume_mm3(const Lattice& lattice);

}  // namespace spinaltap::point_volume
