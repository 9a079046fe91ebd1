#include "core/segment/neighbours.h"

#include <cmath>

namespace spinaltap::segment {
namespace {

constexpr double kUsualDisc_mm = 6;
constexpr double kMostAside_mm = 10;  // in a spine bent sideways by 15 degrees a body

/// A disc lies between the two, and they are of a kind.
bool fits(const Body& wanted, const Body& other, double side) {
  const EndPlate& ours = side > 0 ? wanted.top : wanted.bottom;
  const EndPlate& theirs = side > 0 ? other.bottom : other.top;
  const double disc = dot(theirs.middle - ours.middle, ours.up) * side;
  const double height = other.height_mm / wanted.height_mm, width = other.half_width_mm / wanted.half_width_mm;
  const double aside = std::abs(dot(other.frame.origin_patient - ours.middle, wanted.frame.axes.col_x));
  // plates are planes through dished surfaces: two of a worn disc may overlap a little
  return disc > -4 && disc < 20 && height > 0.55 && height < 1.7 && width > 0.7 && width < 1.4 && aside < kMostAside_mm;
}

Body moved(Body body, const Vec3& shift) {
  body.top.middle += shift, body.bottom.middle += shift, body.frame.origin_patient += shift;
  if (body.canal) *body.canal += shift;
  return body;
}

}  // namespace

Rival findNeighbour(const Scene& scene, const Body& wanted, double side) {
  const EndPlate& plate = side > 0 ? wanted.top : wanted.bottom;
  for (const double disc : {kUsualDisc_mm, 11.0, 3.0}) {
    const Vec3 inside = plate.middle + plate.up * (side * (disc + 0.5 * wanted.height_mm));
    if (!isKnown(scene.block, inside)) continue;
    const auto body = findBody(scene, inside, plate.up);
    if (body && fits(wanted, *body, side)) return {*body, true};
  }
  return {moved(wanted, plate.up * (side * (wanted.height_mm + kUsualDisc_mm))), false};
}

}  // namespace spinaltap::segment
