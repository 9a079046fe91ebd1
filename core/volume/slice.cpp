#include "core/volume/slice.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/box.h"
#include "core/volume/sample.h"

namespace spinaltap::volume {
namespace {

constexpr int kMostPixels = 4096;

Result<void> checkPlane(const SlicePlane& plane) {
  if (!isFinite(plane.origin_patient) || !isFinite(plane.right) || !isFinite(plane.down) ||
      !std::isfinite(plane.pixel_mm)) {
    return fail(ErrorCode::NotFinite, "slice plane is not finite");
  }
  const auto off = [](double value, double wanted) { return std::abs(value - wanted) > 1e-6; };
  if (off(dot(plane.right, plane.right), 1) || off(dot(plane.down, plane.down), 1) ||
      off(dot(plane.right, plane.down), 0)) {
    return fail(ErrorCode::InvalidArgument, "slice axes are not orthonormal");
  }
  if (!(plane.pixel_mm > 0)) return fail(ErrorCode::InvalidArgument, "slice pixel is not positive");
  if (plane.width < 1 || plane.height < 1) return fail(ErrorCode::InvalidArgument, "slice has no pixels");
  if (plane.width > kMostPixels || plane.height > kMostPixels) {
    return fail(ErrorCode::Limit, "slice has more than " + std::to_string(kMostPixels) + " pixels a side");
  }
  return {};
}

/// Half a voxel beyond the outer centres still belongs to the outer voxels.
bool inVolume(const Grid& grid, const Vec3& v) {
  return v.x >= -0.5 && v.y >= -0.5 && v.z >= -0.5 && v.x <= grid.dims[0] - 0.5 && v.y <= grid.dims[1] - 0.5 &&
         v.z <= grid.dims[2] - 0.5;
}

Box boundsInPatient(const Grid& grid) {
  Box box{grid.origin_patient, grid.origin_patient};
  for (int corner = 0; corner < 8; ++corner) {
    box.add(grid.toPatient({(corner & 1) != 0 ? grid.dims[0] - 1.0 : 0, (corner & 2) != 0 ? grid.dims[1] - 1.0 : 0,
                            (corner & 4) != 0 ? grid.dims[2] - 1.0 : 0}));
  }
  return box;
}

}  // namespace

Result<Slice> sliceAlong(const CtVolume& ct, const SlicePlane& plane) {
  if (auto ok = checkPlane(plane); !ok) return tl::unexpected(ok.error());
  if (ct.hu.size() != ct.grid.voxels() || ct.hu.empty()) {
    return fail(ErrorCode::InvalidArgument, "volume has not one value a voxel");
  }
  Slice slice{plane, {}};
  slice.hu.reserve(static_cast<std::size_t>(plane.width) * static_cast<std::size_t>(plane.height));
  for (int r = 0; r < plane.height; ++r) {
    const Vec3 row = plane.origin_patient + plane.down * (r * plane.pixel_mm);
    for (int c = 0; c < plane.width; ++c) {
      const Vec3 voxel = ct.grid.toVoxel(row + plane.right * (c * plane.pixel_mm));
      const bool inside = inVolume(ct.grid, voxel);
      slice.hu.push_back(inside ? static_cast<std::int16_t>(std::floor(sampleHuAtVoxel(ct, voxel) + 0.5)) : kOutsideHu);
    }
  }
  return slice;
}

Result<Slice> sliceThrough(const CtVolume& ct, PatientPlane which, const Vec3& point_patient) {
  if (auto ok = checkGrid(ct.grid); !ok) return tl::unexpected(ok.error());
  const Box box = boundsInPatient(ct.grid);
  const Vec3& p = point_patient;
  const Vec3& s = ct.grid.spacing_mm;
  SlicePlane plane;
  plane.pixel_mm = std::min({s.x, s.y, s.z});
  const auto pixels = [&](double low, double high) {
    return static_cast<int>(std::min(std::floor((high - low) / plane.pixel_mm + 1.5), kMostPixels + 1.0));
  };
  // LPS: x grows to the patient's left, y to the back, z to the head.
  switch (which) {
    case PatientPlane::Axial:
      plane.origin_patient = {box.low.x, box.low.y, p.z};
      plane.right = {1, 0, 0}, plane.down = {0, 1, 0};
      plane.width = pixels(box.low.x, box.high.x), plane.height = pixels(box.low.y, box.high.y);
      break;
    case PatientPlane::Coronal:
      plane.origin_patient = {box.low.x, p.y, box.high.z};
      plane.right = {1, 0, 0}, plane.down = {0, 0, -1};
      plane.width = pixels(box.low.x, box.high.x), plane.height = pixels(box.low.z, box.high.z);
      break;
    case PatientPlane::Sagittal:
      plane.origin_patient = {p.x, box.low.y, box.high.z};
      plane.right = {0, 1, 0}, plane.down = {0, 0, -1};
      plane.width = pixels(box.low.y, box.high.y), plane.height = pixels(box.low.z, box.high.z);
      break;
  }
  return sliceAlong(ct, plane);
}

}  // namespace spinaltap::volume
