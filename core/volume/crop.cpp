#include "core/volume/crop.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>

namespace spinaltap::volume {
namespace {

std::string text(const std::array<int, 3>& voxel) {
  return std::to_string(voxel[0]) + "," + std::to_string(voxel[1]) + "," + std::to_string(voxel[2]);
}

Result<Grid> croppedGrid(const Grid& grid, std::size_t values, const std::array<int, 3>& low,
                         const std::array<int, 3>& high) {
  if (values != grid.voxels()) return fail(ErrorCode::InvalidArgument, "volume has not one value a voxel");
  const bool ordered = low[0] <= high[0] && low[1] <= high[1] && low[2] <= high[2];
  if (!ordered || !grid.contains(low[0], low[1], low[2]) || !grid.contains(high[0], high[1], high[2])) {
    return fail(ErrorCode::InvalidArgument,
                "crop " + text(low) + " to " + text(high) + " does not lie in a grid of " + text(grid.dims));
  }
  Grid out = grid;
  for (std::size_t a = 0; a < 3; ++a) out.dims[a] = high[a] - low[a] + 1;
  out.origin_patient =
      grid.toPatient({static_cast<double>(low[0]), static_cast<double>(low[1]), static_cast<double>(low[2])});
  return out;
}

template <class T>
std::vector<T> copyBox(const Grid& from, const std::vector<T>& values, const Grid& to, const std::array<int, 3>& low) {
  std::vector<T> out(to.voxels());
  auto into = out.begin();
  for (int k = 0; k < to.dims[2]; ++k) {
    for (int j = 0; j < to.dims[1]; ++j) {
      const auto row = values.begin() + static_cast<std::ptrdiff_t>(from.index(low[0], low[1] + j, low[2] + k));
      into = std::copy(row, row + to.dims[0], into);
    }
  }
  return out;
}

}  // namespace

Result<CtVolume> cropTo(const CtVolume& ct, const std::array<int, 3>& low_voxel, const std::array<int, 3>& high_voxel) {
  const auto grid = croppedGrid(ct.grid, ct.hu.size(), low_voxel, high_voxel);
  if (!grid) return tl::unexpected(grid.error());
  return CtVolume{*grid, copyBox(ct.grid, ct.hu, *grid, low_voxel)};
}

Result<LabelVolume> cropTo(const LabelVolume& label, const std::array<int, 3>& low_voxel,
                           const std::array<int, 3>& high_voxel) {
  const auto grid = croppedGrid(label.grid, label.inside.size(), low_voxel, high_voxel);
  if (!grid) return tl::unexpected(grid.error());
  return LabelVolume{*grid, copyBox(label.grid, label.inside, *grid, low_voxel)};
}

Result<VoxelBox> boundsOf(const LabelVolume& label) {
  const Grid& grid = label.grid;
  if (label.inside.size() != grid.voxels()) {
    return fail(ErrorCode::InvalidArgument, "label has not one value a voxel");
  }
  VoxelBox box{grid.dims, {-1, -1, -1}};
  const auto take = [&box](std::size_t axis, int at) {
    box.low[axis] = std::min(box.low[axis], at);
    box.high[axis] = std::max(box.high[axis], at);
  };
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      const std::uint8_t* row = label.inside.data() + grid.index(0, j, k);
      const std::uint8_t* end = row + grid.dims[0];
      const auto is_set = [](std::uint8_t v) { return v != 0; };
      const std::uint8_t* first = std::find_if(row, end, is_set);
      if (first == end) continue;
      const std::uint8_t* last = end - 1;
      while (*last == 0) --last;
      take(0, static_cast<int>(first - row)), take(0, static_cast<int>(last - row));
      take(1, j), take(2, k);
    }
  }
  if (box.high[0] < 0) return fail(ErrorCode::NotFound, "label is empty");
  return box;
}

VoxelBox widened(const VoxelBox& box, const Grid& grid, double margin_mm) {
  assert(margin_mm >= 0 && std::isfinite(margin_mm));
  const double spacing[3] = {grid.spacing_mm.x, grid.spacing_mm.y, grid.spacing_mm.z};
  VoxelBox out = box;
  for (std::size_t a = 0; a < 3; ++a) {
    const int margin = static_cast<int>(std::min(std::ceil(margin_mm / spacing[a]), 1.0 * grid.dims[a]));
    out.low[a] = std::max(0, box.low[a] - margin);
    out.high[a] = std::min(grid.dims[a] - 1, box.high[a] + margin);
  }
  return out;
}

}  // namespace spinaltap::volume
