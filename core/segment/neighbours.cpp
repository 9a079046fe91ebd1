#include "core/segment/neighbours.h"

#include <algorithm>

namespace spinaltap::segment {
namespace {

constexpr double kUsualDisc_mm = 6;

/// A disc lies between the two, and they are of a kind.
bool fits(const Body& wanted, const Body& other, double side) {
  const EndPlate& ours = side > 0 ? wanted.top : wanted.bottom;
  const EndPlate& theirs = side > 0 ? other.bottom : other.top;
  const double disc = dot(theirs.middle - ours.middle, ours.up) * side;
  const double ratio = other.height_mm / wanted.height_mm;
  // plates are planes through dished surfaces: two of a worn disc may overlap a little
  return disc > -4 && disc < 20 && ratio > 0.55 && ratio < 1.7;
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
