#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "core/base/parallel.h"
#include "core/surface/neighbours.h"
#include "core/surface/surface.h"

namespace spinaltap::surface {
namespace {

constexpr double kOfTheBall = 0.8;   // of the largest ball: a clear margin to the next point, and to the medial axis
constexpr double kLeastShare = 0.1;  // of the offset: a sample closer than that to its own point says nothing

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

/// The radius of the largest ball, up to `most`, that touches the surface at a point from the side of the unit vector
/// `way` and holds no other point: a ball of radius r around p + r way holds q when |q - p|^2 < 2 r way . (q - p).
double emptyBall(const Neighbours& near, std::span<const Vec3> places, std::size_t which, const Vec3& way,
                 double most) {
  const Vec3& place = places[which];
  double radius = most;
  near.eachWithin(place + way * most, most, [&](std::size_t n) {
    const Vec3 d = places[n] - place;
    const double along = dot(d, way), square = dot(d, d);
    if (n != which && along > 0 && square > 0) radius = std::min(radius, square / (2 * along));
  });
  return radius;
}

}  // namespace

Result<SignedSamples> makeSamples(const OrientedPoints& points, double offset_mm) {
  if (auto ok = checkPoints(points, offset_mm); !ok) return tl::unexpected(ok.error());
  SignedSamples out;
  out.positions = points.positions_patient;
  out.distances_mm.assign(out.positions.size(), 0.0);
  const std::span<const Vec3> places(points.positions_patient);
  const Neighbours near(places, offset_mm);
  std::vector<double> before(places.size()), behind(places.size());
  parallelBlocks(places.size(), 64, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto room = [&](const Vec3& way) {
        if (dot(way, way) < 0.5) return 0.0;  // a point without a normal
        return std::min(offset_mm, kOfTheBall * emptyBall(near, places, i, way, offset_mm / kOfTheBall));
      };
      before[i] = room(points.normals[i]);
      behind[i] = room(-points.normals[i]);
    }
  });
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (const double distance : {before[i], -behind[i]}) {
      if (std::abs(distance) < kLeastShare * offset_mm) continue;
      out.positions.push_back(places[i] + points.normals[i] * distance);
      out.distances_mm.push_back(distance);
    }
  }
  return out;
}

}  // namespace spinaltap::surface
