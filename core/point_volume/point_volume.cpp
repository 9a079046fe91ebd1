#include "core/point_volume/point_volume.h"

#include <bitset>
#include <cmath>

namespace spinaltap::point_volume {

std::uint16_t densityFromHu(double hu) {
  const double density = std::floor(47.0 + 1.122 * hu + 0.5);
  if (!(density > 0)) return 0;  // NaN as well
  return density < 65535.0 ? static_cast<std::uint16_t>(density) : std::uint16_t{65535};
}

Result<PointVolume> solidVolume(const Lattice& lattice, std::uint16_t density_mg_cm3) {
  if (auto ok = checkLattice(lattice); !ok) return tl::unexpected(ok.error());
  PointVolume volume;
  volume.lattice = lattice;
  const std::uint64_t points = lattice.points();
  volume.alive.assign((points + 63) / 64, ~std::uint64_t{0});
  if (points % 64 != 0) volume.alive.back() = (std::uint64_t{1} << (points % 64)) - 1;
  volume.density_mg_cm3.assign(points, density_mg_cm3);
  return volume;
}

std::uint64_t countAlive(const PointVolume& volume) {
  std::uint64_t count = 0;
  for (const std::uint64_t word : volume.alive) count += std::bitset<64>(word).count();
  return count;
}

std::uint64_t aliveHash(const PointVolume& volume) {
  std::uint64_t hash = 0;
  for (std::uint32_t word = 0; word < volume.alive.size(); ++word) hash += wordHash(word, volume.alive[word]);
  return hash;
}

}  // namespace spinaltap::point_volume
