#include "core/plan/path.h"

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <string>

namespace spinaltap::plan {
namespace {

constexpr double kLongestPath_mm = 500;      // far beyond any vertebra; keeps path-frame coordinates small
constexpr double kWidestVolume_mm = 50;      // radius
constexpr double kFarthestPatient_mm = 1e7;  // ten kilometres from the scanner's origin: doubles still resolve 2 nm

bool allFinite(std::initializer_list<double> values) {
  for (const double v : values) {
    if (!std::isfinite(v)) return false;
  }
  return true;
}

Result<void> checkNumbers(const Path& path) {
  const Vec3 &e = path.entry_patient, &t = path.target_patient;
  if (!isFinite(e) || !isFinite(t)) return fail(ErrorCode::NotFinite, "path: entry or target is not finite");
  if (!allFinite({path.volume_radius_mm, path.lead_mm, path.spacing_mm})) {
    return fail(ErrorCode::NotFinite, "path: volume radius, lead or spacing is not finite");
  }
  for (const double v : {e.x, e.y, e.z, t.x, t.y, t.z}) {
    if (std::abs(v) > kFarthestPatient_mm) {
      return fail(ErrorCode::InvalidArgument, "path: entry or target is more than 1e7 mm from the origin");
    }
  }
  return {};
}

Result<void> checkVolume(const Path& path) {
  if (path.spacing_mm < 0.01 || path.spacing_mm > 1) {
    return fail(ErrorCode::InvalidArgument, "path: spacing must be 0.01 to 1 mm");
  }
  if (path.bit.diameter_mm > 2 * path.volume_radius_mm) {
    return fail(ErrorCode::InvalidArgument, "path: the bit is wider than the modelled volume");
  }
  if (path.volume_radius_mm > kWidestVolume_mm) {
    return fail(ErrorCode::InvalidArgument, "path: volume radius must be at most 50 mm");
  }
  if (path.lead_mm < 0 || path.lead_mm > kLongestPath_mm) {
    return fail(ErrorCode::InvalidArgument, "path: lead must be 0 to 500 mm");
  }
  return {};
}

}  // namespace

Result<void> checkBit(const Bit& bit) {
  if (!allFinite({bit.diameter_mm, bit.cone_length_mm, bit.length_mm})) {
    return fail(ErrorCode::NotFinite, "bit: diameter, cone length or length is not finite");
  }
  if (bit.diameter_mm < 0.5 || bit.diameter_mm > 8) {
    return fail(ErrorCode::InvalidArgument, "bit: diameter must be 0.5 to 8 mm");
  }
  if (bit.cone_length_mm < 0 || bit.length_mm < bit.cone_length_mm) {
    return fail(ErrorCode::InvalidArgument, "bit: cone length must be between 0 and the bit's length");
  }
  if (bit.length_mm <= 0 || bit.length_mm > 200) {
    return fail(ErrorCode::InvalidArgument, "bit: length must be above 0 and at most 200 mm");
  }
  return {};
}

Result<void> checkPath(const Path& path) {
  if (auto ok = checkBit(path.bit); !ok) return ok;
  if (auto ok = checkNumbers(path); !ok) return ok;
  if (auto ok = checkVolume(path); !ok) return ok;
  const double length_mm = length(path);
  if (length_mm < path.spacing_mm) {
    return fail(ErrorCode::Degenerate, "path: entry and target are the same point, or closer than one spacing");
  }
  if (length_mm > kLongestPath_mm) return fail(ErrorCode::InvalidArgument, "path: longer than 500 mm");
  const double rings = std::floor(path.volume_radius_mm / path.spacing_mm + 0.5);
  const double discs = std::floor((path.lead_mm + length_mm) / path.spacing_mm + 0.5);
  if ((3 * rings * (rings - 1) + 1) * discs >= 0x1p31) {
    return fail(ErrorCode::Limit, "path: the volume would hold 2^31 points or more");
  }
  return {};
}

Frame pathFrame(const Path& path) {
  Frame frame;
  frame.origin_patient = path.entry_patient;
  const Vec3 z = normalized(path.target_patient - path.entry_patient);
  const double ax = std::abs(z.x), ay = std::abs(z.y), az = std::abs(z.z);
  Vec3 least{1, 0, 0};
  if (ay < ax && ay <= az) least = {0, 1, 0};
  if (az < ax && az < ay) least = {0, 0, 1};
  const Vec3 x = normalized(least - z * dot(least, z));
  frame.axes = {x, cross(z, x), z};
  return frame;
}

double length(const Path& path) { return norm(path.target_patient - path.entry_patient); }

}  // namespace spinaltap::plan
