#include "core/segment/body.h"

#include <algorithm>
#include <cmath>

#include "core/base/dmath.h"
#include "core/segment/body_box.h"
#include "core/segment/outline.h"

namespace spinaltap::segment {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kMostDrop_hu = 400;
constexpr double kLeastScore_hu =
    300;  // soft tissue stays below 250; a half scanned body has 400, a whole one 500 to 1300
constexpr double kLeastHeight_mm = 8;
constexpr double kLeastContrast_hu = 60;  // of the wall against what lies beside it

double dropAcross(const Scene& scene, const Vec3& middle, const Mat3& axes, double side) {
  constexpr double kRadius_mm = 9, kPitch_mm = 2;
  const Vec3 out = axes.col_z * side;
  double sum = 0;
  int count = 0;
  for (double v = -kRadius_mm; v <= kRadius_mm; v += kPitch_mm) {
    for (double u = -kRadius_mm; u <= kRadius_mm; u += kPitch_mm) {
      if (u * u + v * v > kRadius_mm * kRadius_mm) continue;
      const Vec3 p = middle + axes.col_x * u + axes.col_y * v;
      const double drop =
          valueAt(scene.block, scene.block.hu, p - out) - valueAt(scene.block, scene.block.hu, p + out * 1.5);
      sum += std::clamp(drop, -kMostDrop_hu, kMostDrop_hu);
      ++count;
    }
  }
  return sum / count;
}

struct PlateSearch {
  Vec3 from;     ///< in the body
  Vec3 line;     ///< unit, from there towards the head
  Vec3 up;       ///< the plate's, guessed
  double side;   ///< 1: the plate towards the head, -1: towards the feet
  double at_mm;  ///< where it is, guessed
};

/// Refines a plate to a quarter of a mm and about one degree: the plane across which the HU drop most.
EndPlate refinePlate(const Scene& scene, const PlateSearch& s) {
  const Mat3 guess = axesAlong(s.up);
  EndPlate best;
  const auto visit = [&](double t, double back, double left) {
    const Vec3 middle = s.from + s.line * (s.side * t);
    const Mat3 axes = axesAlong(guess.col_z + guess.col_y * back + guess.col_x * left);
    const double drop = dropAcross(scene, middle, axes, s.side);
    if (drop > best.edge_hu) best = {middle, axes.col_z, drop};
  };
  const auto raster = [&](double t_mid, double t_reach, double t_step, const Vec3& mid, double reach, double step) {
    for (double a = -reach; a <= reach + 1e-9; a += step) {
      for (double b = -reach; b <= reach + 1e-9; b += step) {
        for (double t = t_mid - t_reach; t <= t_mid + t_reach + 1e-9; t += t_step) visit(t, mid.y + a, mid.x + b);
      }
    }
  };
  raster(s.at_mm, 1.5, 0.5, {}, 0.06, 0.03);
  if (best.edge_hu <= 0) return best;
  const Vec3 tilt = transposeTimes(guess, best.up);
  const double at = s.side * dot(best.middle - s.from, s.line);
  best.edge_hu = 0;
  raster(at, 0.5, 0.25, tilt / tilt.z, 0.04, 0.02);
  return best;
}

/// The box's plates are right to about one step of its raster of tilts: looks again, on a line through the body's
/// middle, between those steps.
void finerTilt(const Scene& scene, PlateSearch& search) {
  constexpr double kReach = 0.18, kStep = 0.06;
  const Mat3 guess = axesAlong(search.up);
  const Vec3 out = search.line * search.side;
  const int at = static_cast<int>(std::lround(search.at_mm));
  Face best;
  for (double a = -kReach; a <= kReach + 1e-9; a += kStep) {
    for (double b = -kReach; b <= kReach + 1e-9; b += kStep) {
      const Mat3 m = axesAlong(guess.col_z + guess.col_y * a + guess.col_x * b);
      const auto profile = patchProfile(scene.block, scene.block.hu, search.from, out, {m.col_x, m.col_y, 9, 6, 0}, 40);
      const Face face = firstDisc(profile, valleysBefore(profile), std::max(3, at - 3), at + 3);
      if (face.drop_hu <= std::max(best.drop_hu, kCutFace_hu)) continue;
      best = face, search.at_mm = face.at_mm, search.up = m.col_z;
    }
  }
}

/// @param through  a place on the plate as the box has it.
EndPlate plateOf(const Scene& scene, const Face& face, const Vec3& through, PlateSearch search) {
  search.at_mm = search.side * dot(through - search.from, search.up) / dot(search.line, search.up);
  if (face.drop_hu > kCutFace_hu) {
    finerTilt(scene, search);
    const EndPlate found = refinePlate(scene, search);
    if (found.edge_hu > 0) return found;
  }
  return {search.from + search.line * (search.side * search.at_mm), search.up, 0};
}

double meanHu(const Scene& scene, const Body& body, double u, double v) {
  double sum = 0;
  constexpr double kHeights[4] = {0.1, 0.2, 0.3, 0.4};  // of the pedicles, in parts of the body's
  for (const double f : kHeights) {
    sum += 0.25 * valueAt(scene.block, scene.smooth, body.frame.toPatient({u, v, f * body.height_mm}));
  }
  return sum;
}

/// The middle of the dark place behind the body that bone surrounds on most sides at the pedicles' height.
std::optional<Vec3> findCanal(const Scene& scene, const Body& body, double threshold_hu) {
  constexpr int kRays = 24, kReach_mm = 18;
  double best = 0;
  std::optional<Vec3> canal;
  for (double v = body.back_mm + 3; v <= body.back_mm + 16; v += 1) {
    for (double u = -8; u <= 8; u += 1) {
      std::array<int, kRays> reach{};
      int hits = 0, nearest = kReach_mm;
      for (std::size_t ray = 0; ray < kRays; ++ray) {
        const SinCos a = sinCos(2 * kPi * static_cast<double>(ray) / kRays);
        int r = 0;
        while (r < kReach_mm && meanHu(scene, body, u + r * a.cos, v + r * a.sin) < threshold_hu) ++r;
        reach[ray] = r, hits += r < kReach_mm ? 1 : 0, nearest = std::min(nearest, r);
      }
      // as wide as can be, and midway between the two sides
      const double score = hits + nearest - 0.3 * std::abs(reach[0] - reach[kRays / 2]);
      if (hits < kRays * 2 / 3 || nearest < 3 || score <= best) continue;
      best = score, canal = body.frame.toPatient({u, v, 0.25 * body.height_mm});
    }
  }
  return canal;
}

}  // namespace

ColumnDepth depthIn(const Body& body, const Vec3& local) {
  const Vec3 p = body.frame.toPatient(local);
  const double below_top = dot(body.top.middle - p, body.top.up),
               over_bottom = dot(p - body.bottom.middle, body.bottom.up);
  const double turn = std::atan2(local.y, local.x) / (2 * kPi) * kOutlineRays;
  const double ray = turn < 0 ? turn + kOutlineRays : turn;
  const auto low = static_cast<std::size_t>(ray);
  const double t = ray - static_cast<double>(low);
  const auto wallAt = [&](int level) {
    const Outline& o = body.level_mm[static_cast<std::size_t>(level)];
    return (1 - t) * o[low % kOutlineRays] + t * o[(low + 1) % kOutlineRays];
  };
  const double part = over_bottom / std::max(1.0, below_top + over_bottom);
  const double level =
      std::clamp((part - partOfLevel(0)) / (partOfLevel(1) - partOfLevel(0)), 0.0, kOutlineLevels - 1.0);
  const int under = std::min(static_cast<int>(level), kOutlineLevels - 2);
  const double wall = wallAt(under) + (level - under) * (wallAt(under + 1) - wallAt(under));
  return {wall - std::sqrt(local.x * local.x + local.y * local.y), std::min(below_top, over_bottom)};
}

std::optional<Body> findBody(const Scene& scene, const Vec3& inside, const Vec3& up) {
  BodyBox box = findBox(scene, inside, up);
  if (box.score < kLeastScore_hu) return {};
  for (int step = 0; step < 3; ++step) {  // from its own middle and along its own axis it is seen better
    const BodyBox better = refineBox(scene, box);
    if (step > 0 && better.score <= box.score) break;
    box = better;
  }
  if (box.score < kLeastScore_hu) return {};
  Body body;
  body.score = box.score;
  const Vec3 middle{0.5 * (box.left.at_mm - box.right.at_mm), 0.5 * (box.back.at_mm - box.front.at_mm), 0};
  const Vec3 from = box.frame.toPatient(middle), line = box.frame.axes.col_z;
  body.top = plateOf(scene, box.top, box.top_through, {from, line, box.top_up, 1, 0});
  body.bottom = plateOf(scene, box.bottom, box.bottom_through, {from, line, box.bottom_up, -1, 0});
  if (body.top.edge_hu <= 0 && body.bottom.edge_hu <= 0) return {};
  const Vec3 axis = normalized(body.top.up + body.bottom.up);
  body.height_mm = dot(body.top.middle - body.bottom.middle, axis);
  if (body.height_mm < kLeastHeight_mm) return {};
  body.frame = {(body.top.middle + body.bottom.middle) * 0.5, axesAlong(axis)};
  traceOutline(scene, {0.5 * (box.left.at_mm + box.right.at_mm), 0.5 * (box.front.at_mm + box.back.at_mm)}, body);
  if (body.wall_hu < body.soft_hu + kLeastContrast_hu) return {};
  body.canal = findCanal(scene, body, 0.5 * (body.soft_hu + body.wall_hu));
  return body;
}

}  // namespace spinaltap::segment
