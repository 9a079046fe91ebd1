// core/splats/splats.h - which points can be seen, and the normals to draw them with.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/vec3.h"
#include "core/point_volume/point_volume.h"

namespace spinaltap::splats {

enum class Kind : std::uint8_t { OuterSurface = 0, CutWall = 1 };

/// A disc at an exposed point, facing `normal` (unit, out of the bone), path frame, mm.
struct Splat {
  std::uint32_t index = 0;  ///< of the point in the lattice
  Vec3 position_mm;
  Vec3 normal;
  Kind kind = Kind::OuterSurface;
};

/// The farthest any place inside the lattice can be from its nearest point, as a multiple of the spacing: discs of this
/// radius around the exposed points leave no gap at any tilt. A cubic lattice needs sqrt(3)/2 = 0.866; here slots of a
/// ring are up to pi/3 apart instead of 1, so sqrt((pi/3)^2 + 1 + 1)/2 = 0.880.
inline constexpr double kCoveringRadiusPerSpacing = 0.88;

/// The eight neighbours of a point: two on its ring, six in all on its disc (the rings of a disc have the topology of a
/// triangular lattice: 6 around the centre; 2 in, 2 along, 2 out; at the six corners 1 in, 2 along, 3 out), and the
/// same site on the discs before and after. Neighbourhood is mutual. Sites beyond the lattice are left out: the mesh
/// goes on there, so nothing is exposed by the lattice's own end.
class Neighbours {
 public:
  explicit Neighbours(const point_volume::Lattice& lattice);
  /// Calls visit(index) for each neighbour.
  template <class Visit>
  void forEach(std::uint32_t index, Visit&& visit) const {
    const std::uint32_t disc = index / per_disc_, in_disc = index - disc * per_disc_;
    for (std::uint32_t i = starts_[in_disc]; i < starts_[in_disc + 1]; ++i) visit(disc * per_disc_ + flat_[i]);
    if (disc > 0) visit(index - per_disc_);
    if (disc + 1 < discs_) visit(index + per_disc_);
  }

 private:
  std::uint32_t per_disc_, discs_;
  std::vector<std::uint32_t> starts_, flat_;  ///< neighbours on the disc of point i: flat_[starts_[i] .. starts_[i+1])
};

/// Alive, with at least one neighbour that is not.
[[nodiscard]] bool isExposed(const point_volume::PointVolume& volume, const Neighbours& neighbours,
                             std::uint32_t index);

/// The bit at one pose, as far as normals need it (splats does not know the drill).
struct Cut {
  Vec3 tip_mm;
  Vec3 axis{0, 0, 1};  ///< unit, shank to tip
  double radius_mm = 1.5, cone_length_mm = 5;
};

/// The normal of the wall that the bit leaves at `point_mm`, into the hole: toward the axis beside the cylinder, off
/// the cone's surface beside the cone, -axis straight ahead of the tip.
[[nodiscard]] Vec3 cutNormal(const Cut& cut, const Vec3& point_mm);

/// gradients(points, out), both path frame; outward, any length. Optional everywhere it is taken.
using OuterNormals = std::function<void(std::span<const Vec3>, std::span<Vec3>)>;

/// Every exposed point, by a scan of the whole volume. `before` tells outer surface (exposed there already) from cut
/// wall; pass the volume itself when nothing was cut yet. Normals: outer_normals where given, else from the alive and
/// dead points within two sites.
/// @cost O(#points); some 10 ms a million.
[[nodiscard]] std::vector<Splat> scan(const point_volume::PointVolume& volume, const point_volume::PointVolume& before,
                                      const OuterNormals& outer_normals = {});

/// Keeps the drawn set up to date while the drill removes points. A client that adds takeExposed() and then drops
/// takeHidden() has exactly the exposed points.
class SplatTracker {
 public:
  /// Everything exposed at the start waits for the first takeExposed(). Keeps no reference to `volume`.
  explicit SplatTracker(const point_volume::PointVolume& volume, const OuterNormals& outer_normals = {});

  /// After a cycle: `removed` are the points it removed (already dead in `volume`), `cut` is the bit that did.
  /// @cost O(#removed), eight neighbours each.
  void update(const point_volume::PointVolume& volume, std::span<const std::uint32_t> removed, const Cut& cut);

  /// Exposed since the last call and still alive. @pre the volume of the last update.
  [[nodiscard]] std::vector<Splat> takeExposed(const point_volume::PointVolume& volume);
  /// Taken before, removed since.
  [[nodiscard]] std::vector<std::uint32_t> takeHidden();

 private:
  Neighbours neighbours_;
  point_volume::Lattice lattice_;
  point_volume::DiscTable disc_;
  std::vector<std::uint64_t> queued_;  ///< seen before: waiting or drawn
  std::vector<std::uint64_t> drawn_;   ///< taken by the client
  std::vector<Splat> waiting_;
  std::vector<std::uint32_t> hidden_;
};

}  // namespace spinaltap::splats
