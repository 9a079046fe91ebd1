#include "core/point_volume/lattice.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/base/dmath.h"

namespace spinaltap::point_volume {
namespace {

// Bounds that the drill's rounding margins rely on (core/drill/bounds.h).
constexpr double kWidest_mm = 100, kLongest_mm = 1100;
constexpr int kMostRings = 10000;  // slots are numbered in 16 bits there (core/drill/simd_clearance.h)

int rounded(double value) { return static_cast<int>(std::floor(value + 0.5)); }

}  // namespace

Site Lattice::site(std::uint32_t index) const {
  assert(index < points());
  Site site;
  site.disc = static_cast<int>(index / pointsPerDisc());
  const std::uint32_t rest = index % pointsPerDisc();
  if (rest == 0) return site;
  // ringStart(k) = 3k(k-1) + 1 <= rest, nearly solved for k; the loops do the rest.
  int ring = static_cast<int>(std::sqrt((static_cast<double>(rest) - 1.0) / 3.0));
  while (ringStart(ring) > rest) --ring;
  while (ringStart(ring + 1) <= rest) ++ring;
  site.ring = ring;
  site.slot = static_cast<int>(rest - ringStart(ring));
  return site;
}

Result<void> checkLattice(const Lattice& lattice) {
  if (!std::isfinite(lattice.spacing_mm)) return fail(ErrorCode::NotFinite, "lattice: spacing is not finite");
  if (lattice.spacing_mm < 0.001 || lattice.spacing_mm > 10) {
    return fail(ErrorCode::InvalidArgument, "lattice: spacing must be 0.001 to 10 mm");
  }
  if (lattice.rings < 1 || lattice.discs < 1) {
    return fail(ErrorCode::InvalidArgument, "lattice: at least one ring and one disc are needed");
  }
  if (lattice.rings > kMostRings) return fail(ErrorCode::Limit, "lattice: more than 10,000 rings");
  const double rings = lattice.rings, discs = lattice.discs, first = lattice.first_disc;
  if ((3 * rings * (rings - 1) + 1) * discs >= 0x1p31) {
    return fail(ErrorCode::Limit, "lattice: 2^31 points or more");
  }
  if (rings * lattice.spacing_mm > kWidest_mm) {
    return fail(ErrorCode::InvalidArgument, "lattice: radius above 100 mm");
  }
  if (std::max(std::abs(first), std::abs(first + discs)) * lattice.spacing_mm > kLongest_mm) {
    return fail(ErrorCode::InvalidArgument, "lattice: reaches more than 1100 mm from the entry point");
  }
  return {};
}

Lattice latticeOf(const plan::Path& path) {
  Lattice lattice;
  lattice.spacing_mm = path.spacing_mm;
  lattice.rings = std::max(1, rounded(path.volume_radius_mm / path.spacing_mm));
  lattice.discs = std::max(1, rounded((path.lead_mm + plan::length(path)) / path.spacing_mm));
  lattice.first_disc = -rounded(path.lead_mm / path.spacing_mm);
  return lattice;
}

DiscTable discTable(const Lattice& lattice) {
  DiscTable table;
  table.x_mm.reserve(lattice.pointsPerDisc());
  table.y_mm.reserve(lattice.pointsPerDisc());
  for (int ring = 0; ring < lattice.rings; ++ring) {
    const double radius_mm = static_cast<double>(ring) * lattice.spacing_mm;
    const int slots = Lattice::slotsOf(ring);
    for (int slot = 0; slot < slots; ++slot) {
      const SinCos direction = sinCosOfTurn(slot, slots);
      table.x_mm.push_back(radius_mm * direction.cos);
      table.y_mm.push_back(radius_mm * direction.sin);
    }
  }
  return table;
}

Vec3 positionOf(const Lattice& lattice, std::uint32_t index) {
  const Site site = lattice.site(index);
  const double radius_mm = static_cast<double>(site.ring) * lattice.spacing_mm;
  const SinCos direction = sinCosOfTurn(site.slot, Lattice::slotsOf(site.ring));
  return {radius_mm * direction.cos, radius_mm * direction.sin, lattice.discZ_mm(site.disc)};
}

double pointVolume_mm3(const Lattice& lattice) {
  return kPi / 3.0 * (lattice.spacing_mm * lattice.spacing_mm * lattice.spacing_mm);
}

}  // namespace spinaltap::point_volume
