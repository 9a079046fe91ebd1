#include "core/wire/point_volume_message.h"

#include <cassert>

#include "core/wire/body.h"

namespace spinaltap::wire {
namespace {

constexpr const char* kWhat = "point volume";

}  // namespace

std::vector<std::byte> encodePointVolume(const point_volume::PointVolume& volume) {
  assert(volume.density_mg_cm3.size() == volume.lattice.points());
  assert(volume.alive.size() == (volume.lattice.points() + 63) / 64);
  ByteWriter out;
  out.reserve(36 + 8 * volume.alive.size() + 2 * volume.density_mg_cm3.size());
  out.u32(kPointVolumeMagic), out.u32(1);
  out.f64(volume.lattice.spacing_mm);
  out.i32(volume.lattice.rings), out.i32(volume.lattice.discs), out.i32(volume.lattice.first_disc);
  out.u64(volume.alive.size());
  out.array(std::span<const std::uint64_t>(volume.alive));
  out.array(std::span<const std::uint16_t>(volume.density_mg_cm3));
  return out.take();
}

Result<point_volume::PointVolume> decodePointVolume(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  if (auto ok = readPreamble(in, kWhat, kPointVolumeMagic); !ok) return tl::unexpected(ok.error());
  point_volume::PointVolume volume;
  volume.lattice.spacing_mm = in.f64();
  volume.lattice.rings = in.i32(), volume.lattice.discs = in.i32(), volume.lattice.first_disc = in.i32();
  const std::uint64_t words = in.u64();
  if (in.failed()) return corrupt(kWhat, in.offset(), "ends within its lattice");
  if (auto ok = point_volume::checkLattice(volume.lattice); !ok) return tl::unexpected(ok.error());
  const std::uint64_t points = volume.lattice.points();  // below 2^31
  if (words != (points + 63) / 64) return corrupt(kWhat, 28, "a word count that does not fit its lattice");
  if (in.left() != 8 * words + 2 * points) return corrupt(kWhat, in.offset(), "points that do not fit its length");
  volume.alive = in.array<std::uint64_t>(words);
  volume.density_mg_cm3 = in.array<std::uint16_t>(points);
  if (points % 64 != 0 && (volume.alive.back() >> (points % 64)) != 0) {
    return corrupt(kWhat, 36 + 8 * static_cast<std::size_t>(words) - 8, "alive bits past the last point");
  }
  return volume;
}

}  // namespace spinaltap::wire
