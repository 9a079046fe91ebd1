#include "core/volume/grid.h"

#include <string>

namespace spinaltap::volume {
namespace {

constexpr double kMostVoxels = 2147483648.0;  // 2^31, as promised in the header

Result<void> checkDims(const Grid& grid) {
  double voxels = 1;
  for (const int n : grid.dims) {
    if (n < 1) return fail(ErrorCode::InvalidArgument, "grid has a side of " + std::to_string(n) + " voxels");
    voxels *= n;
  }
  if (voxels > kMostVoxels) return fail(ErrorCode::Limit, "grid has more than 2^31 voxels");
  return {};
}

bool isOrthonormal(const Mat3& m) {
  const double tolerance = 1e-4;
  const auto near = [&](double value, double wanted) { return std::abs(value - wanted) <= tolerance; };
  return near(dot(m.col_x, m.col_x), 1) && near(dot(m.col_y, m.col_y), 1) && near(dot(m.col_z, m.col_z), 1) &&
         near(dot(m.col_x, m.col_y), 0) && near(dot(m.col_x, m.col_z), 0) && near(dot(m.col_y, m.col_z), 0);
}

}  // namespace

Vec3 Grid::toPatient(const Vec3& voxel) const {
  return origin_patient + direction * Vec3{voxel.x * spacing_mm.x, voxel.y * spacing_mm.y, voxel.z * spacing_mm.z};
}

Vec3 Grid::toVoxel(const Vec3& patient) const {
  const Vec3 local = transposeTimes(direction, patient - origin_patient);
  return {local.x / spacing_mm.x, local.y / spacing_mm.y, local.z / spacing_mm.z};
}

Result<void> checkGrid(const Grid& grid) {
  if (auto dims = checkDims(grid); !dims) return dims;
  const Mat3& m = grid.direction;
  if (!isFinite(grid.spacing_mm) || !isFinite(grid.origin_patient) || !isFinite(m.col_x) || !isFinite(m.col_y) ||
      !isFinite(m.col_z)) {
    return fail(ErrorCode::NotFinite, "grid spacing, origin or direction is not finite");
  }
  if (!(grid.spacing_mm.x > 0 && grid.spacing_mm.y > 0 && grid.spacing_mm.z > 0)) {
    return fail(ErrorCode::InvalidArgument, "grid spacing is not positive");
  }
  if (!isOrthonormal(m)) return fail(ErrorCode::InvalidArgument, "grid direction is not orthonormal");
  if (dot(cross(m.col_x, m.col_y), m.col_z) < 0) {
    return fail(ErrorCode::InvalidArgument, "grid direction is left-handed");
  }
  return {};
}

}  // namespace spinaltap::volume
