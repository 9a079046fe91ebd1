#include "core/splats/normals.h"

#include <algorithm>

namespace spinaltap::splats {
namespace {

constexpr int kReach = 2;
constexpr double kReachInSpacings = 2.6;
constexpr int kAllSlotsUpToRing = 4;  ///< near the centre, what is near lies on the other side too

struct Middle {
  Vec3 sum;
  int count = 0;
  void add(const Vec3& v) {
    sum += v;
    ++count;
  }
};

/// Calls visit(slot) for the slots of `ring` that lie nearest to slot `slot` of ring `from`, kReach to either side.
template <class Visit>
void forSlotsNear(int from, int slot, int ring, Visit&& visit) {
  const int slots = point_volume::Lattice::slotsOf(ring);
  if (ring <= kAllSlotsUpToRing) {
    for (int s = 0; s < slots; ++s) visit(s);
    return;
  }
  const int nearest = (2 * slot * ring + from) / (2 * from);  // slot * ring / from, rounded
  for (int s = nearest - kReach; s <= nearest + kReach; ++s) visit((s + slots) % slots);
}

}  // namespace

Vec3 positionOf(const point_volume::Lattice& lattice, const point_volume::DiscTable& disc, std::uint32_t index) {
  const std::uint32_t per_disc = lattice.pointsPerDisc();
  const std::uint32_t in_disc = index % per_disc;
  return {disc.x_mm[in_disc], disc.y_mm[in_disc], lattice.discZ_mm(static_cast<int>(index / per_disc))};
}

Vec3 estimateNormal(const point_volume::PointVolume& volume, const point_volume::DiscTable& disc, std::uint32_t index) {
  const point_volume::Lattice& lattice = volume.lattice;
  const point_volume::Site site = lattice.site(index);
  const Vec3 here = positionOf(lattice, disc, index);
  const double reach_mm = kReachInSpacings * lattice.spacing_mm;
  Middle alive, dead;
  for (int d = std::max(0, site.disc - kReach); d <= std::min(lattice.discs - 1, site.disc + kReach); ++d) {
    for (int k = std::max(0, site.ring - kReach); k <= std::min(lattice.rings - 1, site.ring + kReach); ++k) {
      forSlotsNear(site.ring, site.slot, k, [&](int slot) {
        const std::uint32_t other = lattice.index({d, k, slot});
        const Vec3 offset = positionOf(lattice, disc, other) - here;
        if (dot(offset, offset) <= reach_mm * reach_mm) (volume.isAlive(other) ? alive : dead).add(offset);
      });
    }
  }
  Vec3 normal;
  if (dead.count > 0) normal += dead.sum / dead.count;
  if (alive.count > 0) normal -= alive.sum / alive.count;
  const double length = norm(normal);
  return length > 1e-6 * lattice.spacing_mm ? normal / length : Vec3{0, 0, -1};
}

}  // namespace spinaltap::splats
