// core/volume/slice.h - flat pictures of a volume: along the patient's axes or in any plane (the view down the drill).
#pragma once
#include <cstdint>
#include <vector>

#include "core/volume/grid.h"

namespace spinaltap::volume {

/// Pixel (c, r) has its centre at origin_patient + right * (c * pixel_mm) + down * (r * pixel_mm).
struct SlicePlane {
  Vec3 origin_patient;  ///< centre of the first pixel
  Vec3 right{1, 0, 0};  ///< unit, towards higher columns
  Vec3 down{0, 1, 0};   ///< unit, towards higher rows, at right angles to `right`
  double pixel_mm = 1;
  int width = 0, height = 0;
};

struct Slice {
  SlicePlane plane;
  std::vector<std::int16_t> hu;  ///< #height x #width, row by row
};

/// HU that a pixel outside the volume gets: air.
inline constexpr std::int16_t kOutsideHu = -1024;

/// Trilinear, rounded to whole HU.
/// @error InvalidArgument (axes not orthonormal to 1e-6, pixel not positive, width or height below 1), Limit (over
///        4096 pixels a side), NotFinite.
[[nodiscard]] Result<Slice> sliceAlong(const CtVolume& ct, const SlicePlane& plane);

enum class PatientPlane { Axial, Coronal, Sagittal };

/// The plane through a point that covers the whole volume, as radiologists look at it: axial from the feet with the
/// front up, coronal from the front with the head up, sagittal from the left with the head up. Pixels are as large as
/// the smallest voxel edge.
/// @error as sliceAlong.
[[nodiscard]] Result<Slice> sliceThrough(const CtVolume& ct, PatientPlane plane, const Vec3& point_patient);

}  // namespace spinaltap::volume
