#include <cmath>
#include <string>

#include "core/surface/neighbours.h"
#include "core/surface/surface.h"

namespace spinaltap::surface {
namespace {

constexpr int kHalvings = 4;  // 1, 1/2, 1/4, 1/8 of the offset; less than a tenth is dropped

Result<void> checkPoints(const OrientedPoints& points, double offset_mm) {
  if (points.positions_patient.size() != points.normals.size()) {
    return fail(ErrorCode::InvalidArgument, "boundary points and normals differ in number");
  }
  if (points.positions_patient.empty()) return fail(ErrorCode::Degenerate, "there are no boundary points");
  if (!(offset_mm > 0) || !std::isfinite(offset_mm)) {
    return fail(ErrorCode::InvalidArgument, "the offset of off-surface samples is not positive");
  }
  for (std::size_t i = 0; i < points.normals.size(); ++i) {
    if (!isFinite(points.positions_patient[i]) || !isFinite(points.normals[i])) {
      return fail(ErrorCode::NotFinite, "boundary point " + std::to_string(i) + " is not finite");
    }
  }
  return {};
}

}  // namespace

Result<SignedSamples> makeSamples(const OrientedPoints& points, double offset_mm) {
  if (auto ok = checkPoints(points, offset_mm); !ok) return tl::unexpected(ok.error());
  SignedSamples out;
  out.positions = points.positions_patient;
  out.distances_mm.assign(out.positions.size(), 0.0);
  const Neighbours near(points.positions_patient, offset_mm);
  const auto is_own = [&](const Vec3& place, double distance, std::size_t self) {
    bool own = true;
    // A hair less than its own distance: points at one place may not shut each other out.
    near.eachWithin(place, distance * (1 - 1e-6), [&](std::size_t n) { own = own && n == self; });
    return own;
  };
  for (std::size_t i = 0; i < points.normals.size(); ++i) {
    for (const double side : {1.0, -1.0}) {
      double distance = offset_mm;
      for (int round = 0; round < kHalvings; ++round, distance /= 2) {
        const Vec3 place = points.positions_patient[i] + points.normals[i] * (side * distance);
        if (!is_own(place, distance, i)) continue;
        out.positions.push_back(place);
        out.distances_mm.push_back(side * distance);
        break;
      }
    }
  }
  return out;
}

}  // namespace spinaltap::surface
