#include "core/point_volume/pieces.h"

#include <algorithm>
#include <cassert>
#include <string>

namespace spinaltap::point_volume {

Lattice discsOf(const Lattice& lattice, int begin, int end) {
  Lattice part = lattice;
  part.discs = end - begin;
  part.first_disc = lattice.first_disc + begin;
  return part;
}

Result<PointVolume> emptyVolume(const Lattice& lattice) {
  if (auto ok = checkLattice(lattice); !ok) return tl::unexpected(ok.error());
  PointVolume volume;
  volume.lattice = lattice;
  volume.alive.assign(static_cast<std::size_t>((lattice.points() + 63) / 64), 0);
  volume.density_mg_cm3.assign(static_cast<std::size_t>(lattice.points()), 0);
  return volume;
}

Result<PointVolume> buildDiscs(const Lattice& lattice, int begin, int end, const Frame& path_frame, const Field& field,
                               const HuSampler& hu, unsigned threads) {
  if (auto ok = checkLattice(lattice); !ok) return tl::unexpected(ok.error());
  if (begin < 0 || end > lattice.discs || begin >= end) {
    return fail(ErrorCode::InvalidArgument, "point volume: discs " + std::to_string(begin) + " to " +
                                                std::to_string(end) + " of " + std::to_string(lattice.discs));
  }
  return buildVolume(discsOf(lattice, begin, end), path_frame, field, hu, threads);
}

void place(const PointVolume& piece, int begin, PointVolume& volume) {
  assert(piece.lattice == discsOf(volume.lattice, begin, begin + piece.lattice.discs));
  const std::uint64_t per_disc = volume.lattice.pointsPerDisc();
  const std::uint64_t start = static_cast<std::uint64_t>(begin) * per_disc, count = piece.lattice.points();
  std::copy(piece.density_mg_cm3.begin(), piece.density_mg_cm3.end(),
            volume.density_mg_cm3.begin() + static_cast<std::ptrdiff_t>(start));
  // Word by word of the piece: each lands in one or two words of the volume.
  const std::uint64_t shift = start & 63;
  for (std::uint64_t word = 0; word < piece.alive.size(); ++word) {
    const std::uint64_t left = count - 64 * word;
    const std::uint64_t mask = left >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << left) - 1;
    const std::uint64_t bits = piece.alive[word] & mask;
    std::uint64_t* const to = volume.alive.data() + (start >> 6) + word;
    to[0] = (to[0] & ~(mask << shift)) | bits << shift;
    if (shift == 0 || mask >> (64 - shift) == 0) continue;
    to[1] = (to[1] & ~(mask >> (64 - shift))) | bits >> (64 - shift);
  }
}

}  // namespace spinaltap::point_volume
