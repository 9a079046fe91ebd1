// core/surface/local_shape.h - the quadric through what lies around a point of a surface.
#pragma once
#include <span>

#include "core/surface/neighbours.h"

namespace spinaltap::surface {

/// Points of a surface with rough outward normals, and their neighbourhoods.
struct SurfacePoints {
  std::span<const Vec3> places;
  std::span<const Vec3> normals;  ///< unit; each within a right angle of the truth
  const Neighbours* near = nullptr;
};

struct LocalShape {
  Vec3 normal;             ///< unit, of the quadric where the point lies
  double height_mm = 0;    ///< of the quadric over the point, along the rough normal
  double rms_mm = 0;       ///< of the points about the quadric, weighted as in the fit
  std::size_t points = 0;  ///< that it was laid through; below kLeastForShape the rough normal is handed back
};

inline constexpr std::size_t kLeastForShape = 5;

/// Height over the rough tangent plane as a quadratic function, by least squares with weights exp(-2 d^2 / radius^2)
/// over the points within the radius whose normals are within some 70 degrees of this one's (the other wall of a thin
/// plate is none of it).
[[nodiscard]] LocalShape shapeAround(const SurfacePoints& points, std::size_t which, double radius_mm);

}  // namespace spinaltap::surface
