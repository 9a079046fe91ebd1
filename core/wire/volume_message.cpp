#include "core/wire/volume_message.h"

#include <cassert>

#include "core/wire/body.h"

namespace spinaltap::wire {
namespace {

constexpr const char* kWhat = "volume";

Result<VolumeGrid> readGrid(ByteReader& in) {
  VolumeGrid grid;
  for (int& n : grid.dims) n = in.i32();
  grid.spacing_mm = in.vec3();
  grid.origin_patient = in.vec3();
  grid.direction = {in.vec3(), in.vec3(), in.vec3()};
  if (in.failed()) return corrupt(kWhat, in.offset(), "ends within its grid");
  const Vec3& s = grid.spacing_mm;
  if (!isFinite(s) || !(s.x > 0) || !(s.y > 0) || !(s.z > 0)) {
    return corrupt(kWhat, 20, "a spacing that is not above zero");
  }
  if (!isFinite(grid.origin_patient)) return corrupt(kWhat, 44, "an origin that is not finite");
  const Mat3& d = grid.direction;
  if (!isFinite(d.col_x) || !isFinite(d.col_y) || !isFinite(d.col_z)) {
    return corrupt(kWhat, 68, "a direction that is not finite");
  }
  return grid;
}

}  // namespace

std::vector<std::byte> encodeVolume(const VolumeGrid& grid, std::span<const std::int16_t> hu) {
  assert(hu.size() == static_cast<std::size_t>(grid.dims[0]) * static_cast<std::size_t>(grid.dims[1]) *
                          static_cast<std::size_t>(grid.dims[2]));
  ByteWriter out;
  out.reserve(140 + hu.size_bytes());
  out.u32(kVolumeMagic), out.u32(1);
  for (const int n : grid.dims) out.i32(n);
  out.vec3(grid.spacing_mm), out.vec3(grid.origin_patient);
  out.vec3(grid.direction.col_x), out.vec3(grid.direction.col_y), out.vec3(grid.direction.col_z);
  out.array(hu);
  return out.take();
}

Result<VolumeMessage> decodeVolume(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  if (auto ok = readPreamble(in, kWhat, kVolumeMagic); !ok) return tl::unexpected(ok.error());
  Result<VolumeGrid> grid = readGrid(in);
  if (!grid) return tl::unexpected(grid.error());
  std::uint64_t voxels = 1;  // at most (bytes / 2) * 2^31 before each check: cannot wrap
  for (const int n : grid->dims) {
    if (n <= 0) return corrupt(kWhat, 8, "a dimension that is not above zero");
    voxels *= static_cast<std::uint64_t>(n);
    if (voxels > in.left() / 2) return corrupt(kWhat, 8, "dimensions that do not fit its length");
  }
  VolumeMessage message{*grid, in.array<std::int16_t>(voxels)};
  if (auto ok = checkEnd(in, kWhat); !ok) return tl::unexpected(ok.error());
  return message;
}

}  // namespace spinaltap::wire
