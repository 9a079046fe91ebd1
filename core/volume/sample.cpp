#include "core/volume/sample.h"

#include <cassert>

namespace spinaltap::volume {
namespace {

/// The voxel below a clamped coordinate, the step to the one above (0 at the edge), and the share of the latter.
struct Cell {
  std::size_t below, step;
  double share;
};

Cell cellOf(double coordinate, int count, std::size_t stride) {
  if (!(coordinate > 0)) return {0, 0, 0};
  if (coordinate >= count - 1) return {static_cast<std::size_t>(count - 1) * stride, 0, 0};
  const auto below = static_cast<std::size_t>(coordinate);
  return {below * stride, stride, coordinate - static_cast<double>(below)};
}

template <class T>
double trilinear(const Grid& grid, const T* values, const Vec3& voxel) {
  const auto row = static_cast<std::size_t>(grid.dims[0]);
  const Cell x = cellOf(voxel.x, grid.dims[0], 1);
  const Cell y = cellOf(voxel.y, grid.dims[1], row);
  const Cell z = cellOf(voxel.z, grid.dims[2], row * static_cast<std::size_t>(grid.dims[1]));
  const auto along_x = [&](std::size_t at) {
    const double a = values[at], b = values[at + x.step];
    return a + (b - a) * x.share;
  };
  const auto along_y = [&](std::size_t at) {
    const double a = along_x(at), b = along_x(at + y.step);
    return a + (b - a) * y.share;
  };
  const std::size_t corner = x.below + y.below + z.below;
  const double a = along_y(corner), b = along_y(corner + z.step);
  return a + (b - a) * z.share;
}

}  // namespace

double sampleHuAtVoxel(const CtVolume& ct, const Vec3& voxel) {
  assert(ct.hu.size() == ct.grid.voxels() && !ct.hu.empty());
  return trilinear(ct.grid, ct.hu.data(), voxel);
}

double sampleHu(const CtVolume& ct, const Vec3& patient) { return sampleHuAtVoxel(ct, ct.grid.toVoxel(patient)); }

double sampleAtVoxel(const Grid& grid, std::span<const float> values, const Vec3& voxel) {
  assert(values.size() == grid.voxels() && !values.empty());
  return trilinear(grid, values.data(), voxel);
}

}  // namespace spinaltap::volume
