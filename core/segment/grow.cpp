#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/segment/distance.h"
#include "core/segment/flood.h"
#include "core/segment/segment.h"
#include "core/volume/crop.h"
#include "core/volume/sample.h"

namespace spinaltap::segment {
namespace {

using volume::CtVolume;
using volume::Grid;
using volume::LabelVolume;
using volume::VoxelBox;

constexpr double kLeastIsland_mm3 = 500;  // a hundredth of a vertebra

double axisOf(const Vec3& v, std::size_t axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

Result<void> checkOptions(const CtVolume& ct, const GrowOptions& o) {
  if (auto ok = volume::checkGrid(ct.grid); !ok) return ok;
  if (ct.hu.size() != ct.grid.voxels()) return fail(ErrorCode::InvalidArgument, "volume has not one value a voxel");
  if (!isFinite(o.seed_patient) || !isFinite(o.half_box_mm) || !isFinite(o.box_offset_mm) ||
      !std::isfinite(o.threshold_hu)) {
    return fail(ErrorCode::NotFinite, "segmentation seed, box or threshold is not finite");
  }
  const auto good = [](double value) { return value >= 0 && std::isfinite(value); };
  if (!good(o.neck_mm) || !good(o.closing_mm) || !good(o.seed_reach_mm) || !(o.max_volume_mm3 > 0)) {
    return fail(ErrorCode::InvalidArgument, "segmentation neck, closing, reach or largest volume is out of range");
  }
  if (!(o.half_box_mm.x > 0 && o.half_box_mm.y > 0 && o.half_box_mm.z > 0)) {
    return fail(ErrorCode::InvalidArgument, "segmentation box is empty");
  }
  const Vec3 v = ct.grid.toVoxel(o.seed_patient);
  for (std::size_t a = 0; a < 3; ++a) {
    if (axisOf(v, a) < -0.5 || axisOf(v, a) > ct.grid.dims[a] - 0.5) {
      return fail(ErrorCode::InvalidArgument, "the seed lies outside the volume");
    }
  }
  return {};
}

/// Growth happens in here: the voxels of one box that are bone and lie in the patient-axis box.
struct Region {
  Mask bone;
  VoxelBox box;  ///< where it lies in the CT
  Grid grid;     ///< of the box
};

/// The voxels that can hold the patient-axis box, however the grid is turned.
VoxelBox voxelsOf(const Grid& grid, const Vec3& middle, const Vec3& half) {
  const Mat3& m = grid.direction;
  const Vec3 at = grid.toVoxel(middle);
  const Vec3 columns[3] = {m.col_x, m.col_y, m.col_z};
  VoxelBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    const double reach =
        (std::abs(columns[a].x) * half.x + std::abs(columns[a].y) * half.y + std::abs(columns[a].z) * half.z) /
        axisOf(grid.spacing_mm, a);
    const double last = grid.dims[a] - 1;
    box.low[a] = static_cast<int>(std::clamp(std::floor(axisOf(at, a) - reach), 0.0, last));
    box.high[a] = static_cast<int>(std::clamp(std::ceil(axisOf(at, a) + reach), 0.0, last));
  }
  return box;
}

Result<Region> regionOf(const CtVolume& ct, const GrowOptions& o) {
  const Vec3 middle = o.seed_patient + o.box_offset_mm;
  const VoxelBox box = voxelsOf(ct.grid, middle, o.half_box_mm);
  const auto part = volume::cropTo(ct, box.low, box.high);
  if (!part) return tl::unexpected(part.error());
  Region region{{part->grid.dims, part->grid.spacing_mm, std::vector<std::uint8_t>(part->hu.size())}, box, part->grid};
  std::size_t v = 0;
  for (int k = 0; k < part->grid.dims[2]; ++k) {
    for (int j = 0; j < part->grid.dims[1]; ++j) {
      for (int i = 0; i < part->grid.dims[0]; ++i, ++v) {
        if (part->hu[v] < o.threshold_hu) continue;
        const Vec3 d = part->grid.toPatient({1.0 * i, 1.0 * j, 1.0 * k}) - middle;
        const bool in =
            std::abs(d.x) <= o.half_box_mm.x && std::abs(d.y) <= o.half_box_mm.y && std::abs(d.z) <= o.half_box_mm.z;
        region.bone.set[v] = in ? 1 : 0;
      }
    }
  }
  return region;
}

/// The set voxels within reach of a place (continuous voxel coordinates of the mask), nearest first. The voxel that
/// holds the place counts even when the reach is tiny.
std::vector<std::size_t> setVoxelsNear(const Mask& mask, const Vec3& at, double reach_mm) {
  const double longest = std::max(reach_mm, 0.5 * norm(mask.spacing_mm));
  VoxelBox near;
  for (std::size_t a = 0; a < 3; ++a) {
    const double reach = longest / axisOf(mask.spacing_mm, a);
    const double last = mask.dims[a] - 1;
    near.low[a] = static_cast<int>(std::clamp(std::floor(axisOf(at, a) - reach), 0.0, last));
    near.high[a] = static_cast<int>(std::clamp(std::ceil(axisOf(at, a) + reach), 0.0, last));
  }
  std::vector<std::pair<double, std::size_t>> found;
  for (int k = near.low[2]; k <= near.high[2]; ++k) {
    for (int j = near.low[1]; j <= near.high[1]; ++j) {
      for (int i = near.low[0]; i <= near.high[0]; ++i) {
        if (mask.set[mask.index(i, j, k)] == 0) continue;
        const double d =
            norm({(i - at.x) * mask.spacing_mm.x, (j - at.y) * mask.spacing_mm.y, (k - at.z) * mask.spacing_mm.z});
        if (d <= longest) found.emplace_back(d, mask.index(i, j, k));
      }
    }
  }
  std::sort(found.begin(), found.end());
  std::vector<std::size_t> out;
  for (const auto& [distance, voxel] : found) out.push_back(voxel);
  return out;
}

/// Noise makes specks in marrow that is darker than the threshold: they are passed over on the way to the shell.
std::vector<std::size_t> islandNear(Mask& bone, const Vec3& seed, double reach_mm, std::size_t least,
                                    std::size_t most) {
  for (const std::size_t start : setVoxelsNear(bone, seed, reach_mm)) {
    if (bone.set[start] == 0) continue;  // of a speck taken before
    std::vector<std::size_t> island = takeConnected(bone, start, most);
    if (island.size() >= least) return island;
  }
  return {};
}

Error noBoneAtSeed(const CtVolume& ct, const GrowOptions& o) {
  const auto whole = [](double hu) { return std::to_string(static_cast<long>(std::lround(hu))); };
  return {ErrorCode::NotFound, "no bone at the seed: " + whole(volume::sampleHu(ct, o.seed_patient)) +
                                   " HU there, and no bone of " + whole(o.threshold_hu) + " HU or more within " +
                                   whole(o.seed_reach_mm) + " mm"};
}

Error leaked(const GrowOptions& o) {
  return {ErrorCode::Limit, "the region grew beyond " + std::to_string(static_cast<long>(o.max_volume_mm3)) +
                                " mm3: raise the threshold, or give a box"};
}

/// A part of the region with room around it, so that fills and dilations can pass outside.
struct Island {
  Mask mask;
  std::array<int, 3> at;  ///< its voxel (0, 0, 0) in the region; may be negative
};

Island islandOf(const Mask& bone, const std::vector<std::size_t>& voxels, double room_mm) {
  const auto row = static_cast<std::size_t>(bone.dims[0]), rows = static_cast<std::size_t>(bone.dims[1]);
  const auto place = [&](std::size_t v) {
    return std::array<int, 3>{static_cast<int>(v % row), static_cast<int>(v / row % rows),
                              static_cast<int>(v / row / rows)};
  };
  std::array<int, 3> low = bone.dims, high{0, 0, 0};
  for (const std::size_t v : voxels) {
    const auto p = place(v);
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
  }
  Island island;
  std::size_t count = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const int room = static_cast<int>(std::ceil(room_mm / axisOf(bone.spacing_mm, a))) + 2;
    island.at[a] = low[a] - room;
    island.mask.dims[a] = high[a] - low[a] + 1 + 2 * room;
    count *= static_cast<std::size_t>(island.mask.dims[a]);
  }
  island.mask.spacing_mm = bone.spacing_mm;
  island.mask.set.assign(count, 0);
  for (const std::size_t v : voxels) {
    const auto p = place(v);
    island.mask.set[island.mask.index(p[0] - island.at[0], p[1] - island.at[1], p[2] - island.at[2])] = 1;
  }
  return island;
}

/// The marrow: whatever the shell encloses in 3-D once its gaps are bridged.
void fillMarrow(Mask& bone, double closing_mm) {
  Mask closed = closing_mm > 0 ? dilated(bone, closing_mm) : bone;
  fillHoles(closed);
  if (closing_mm > 0) closed = eroded(closed, closing_mm);
  for (std::size_t v = 0; v < bone.set.size(); ++v) bone.set[v] |= closed.set[v];
  fillHoles(bone);
}

/// Keeps what hangs together with the seed after narrow bridges have been eroded away, grown back to its old outline.
bool cutNecks(Mask& bone, const Vec3& seed, double neck_mm) {
  Mask core = eroded(bone, neck_mm);
  const std::vector<std::size_t> kept = islandNear(core, seed, 6 * neck_mm, 1, core.set.size());
  if (kept.empty()) return false;
  std::fill(core.set.begin(), core.set.end(), std::uint8_t{0});
  for (const std::size_t v : kept) core.set[v] = 1;
  const double back = neck_mm + 0.5 * norm(bone.spacing_mm);
  const Mask grown = dilated(core, back);
  for (std::size_t v = 0; v < bone.set.size(); ++v) bone.set[v] &= grown.set[v];
  return true;
}

LabelVolume placeInto(const Grid& grid, const Island& island, const VoxelBox& box) {
  LabelVolume out{grid, std::vector<std::uint8_t>(grid.voxels(), 0)};
  std::size_t v = 0;
  for (int k = 0; k < island.mask.dims[2]; ++k) {
    for (int j = 0; j < island.mask.dims[1]; ++j) {
      for (int i = 0; i < island.mask.dims[0]; ++i, ++v) {
        if (island.mask.set[v] == 0) continue;
        const int x = i + island.at[0] + box.low[0], y = j + island.at[1] + box.low[1],
                  z = k + island.at[2] + box.low[2];
        if (grid.contains(x, y, z)) out.inside[grid.index(x, y, z)] = 1;
      }
    }
  }
  return out;
}

}  // namespace

Result<LabelVolume> growFromSeed(const CtVolume& ct, const GrowOptions& options) {
  if (auto ok = checkOptions(ct, options); !ok) return tl::unexpected(ok.error());
  auto region = regionOf(ct, options);
  if (!region) return tl::unexpected(region.error());
  const Vec3& s = ct.grid.spacing_mm;
  const double voxel_mm3 = s.x * s.y * s.z;
  const double most = std::min(options.max_volume_mm3 / voxel_mm3, static_cast<double>(ct.grid.voxels()));
  const auto voxels =
      islandNear(region->bone, region->grid.toVoxel(options.seed_patient), options.seed_reach_mm,
                 static_cast<std::size_t>(std::ceil(kLeastIsland_mm3 / voxel_mm3)), static_cast<std::size_t>(most));
  if (voxels.empty()) return tl::unexpected(noBoneAtSeed(ct, options));
  if (static_cast<double>(voxels.size()) > most) return tl::unexpected(leaked(options));

  Island island = islandOf(region->bone, voxels, options.closing_mm);
  fillMarrow(island.mask, options.closing_mm);
  if (options.neck_mm > 0) {
    const Vec3 shift{1.0 * island.at[0], 1.0 * island.at[1], 1.0 * island.at[2]};
    if (!cutNecks(island.mask, region->grid.toVoxel(options.seed_patient) - shift, options.neck_mm)) {
      return fail(ErrorCode::NotFound, "nothing at the seed is wide enough to survive the cutting of necks");
    }
  }
  return placeInto(ct.grid, island, region->box);
}

}  // namespace spinaltap::segment
