#include "core/segment/outline.h"

#include <algorithm>
#include <cmath>

#include "core/base/dmath.h"

namespace spinaltap::segment {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kMostDrop_hu = 400;  // so that one calcified spot does not pull the path
constexpr double kNearest_mm = 6, kFarthest_mm = 38, kRayStep_mm = 0.5;
constexpr int kRaySteps = static_cast<int>((kFarthest_mm - kNearest_mm) / kRayStep_mm) + 1;

/// Mean HU by angle and distance from the axis.
using Polar = std::array<std::array<double, kRaySteps>, kOutlineRays>;

SinCos angleOf(std::size_t ray) { return sinCos(2 * kPi * static_cast<double>(ray) / kOutlineRays); }

/// Over the heights low .. high of the frame.
Polar polarMean(const Block& block, const std::vector<float>& values, const Frame& frame, double low, double high) {
  Polar polar{};
  for (std::size_t ray = 0; ray < kOutlineRays; ++ray) {
    const SinCos a = angleOf(ray);
    for (int step = 0; step < kRaySteps; ++step) {
      const double r = kNearest_mm + step * kRayStep_mm;
      double sum = 0;
      int count = 0;
      for (double z = low; z <= high; z += 1.0, ++count) {
        sum += valueAt(block, values, frame.toPatient({r * a.cos, r * a.sin, z}));
      }
      polar[ray][static_cast<std::size_t>(step)] = sum / std::max(1, count);
    }
  }
  return polar;
}

double at(const std::array<double, kRaySteps>& ray, int step) {
  return ray[static_cast<std::size_t>(std::clamp(step, 0, kRaySteps - 1))];
}

/// How well the wall lies at a step of a ray: the drop in HU from 1 mm inside to 1.5 mm outside.
double wallAt(const std::array<double, kRaySteps>& ray, int step) {
  return std::clamp(at(ray, step - 2) - at(ray, step + 3), -kMostDrop_hu, kMostDrop_hu);
}

/// From where to where a path may run on each ray, mm.
struct Band {
  Outline least{}, most{};
};

double radiusOf(const Ellipse& e, const SinCos& a) {
  return e.half_width * e.half_depth /
         std::sqrt(e.half_depth * e.half_depth * a.cos * a.cos + e.half_width * e.half_width * a.sin * a.sin);
}

/// The closed path of steps with the largest sum of walls, neighbours at most 1 mm apart: three times round, so that
/// the middle turn closes on itself.
Outline closedWall(const Polar& polar, const Band& band) {
  constexpr std::size_t kRays = 3 * std::size_t{kOutlineRays};
  constexpr int kMostJump = 2;
  std::vector<std::array<double, kRaySteps>> sum(kRays);
  std::vector<std::array<int, kRaySteps>> from(kRays);
  for (std::size_t n = 0; n < sum.size(); ++n) {
    const auto& ray = polar[n % kOutlineRays];
    const double least = band.least[n % kOutlineRays], most = band.most[n % kOutlineRays];
    for (int s = 0; s < kRaySteps; ++s) {
      double best = n == 0 ? 0 : -1e300;
      int best_from = s;
      for (int q = std::max(0, s - kMostJump); n > 0 && q <= std::min(kRaySteps - 1, s + kMostJump); ++q) {
        // a bend costs a little, so that noise does not make the wall wander
        const double here = sum[n - 1][static_cast<std::size_t>(q)] - 10.0 * (q - s) * (q - s);
        if (here > best) best = here, best_from = q;
      }
      const double r = kNearest_mm + s * kRayStep_mm;
      const bool far = r < least || r > most;
      sum[n][static_cast<std::size_t>(s)] = best + (far ? -kMostDrop_hu : wallAt(ray, s));
      from[n][static_cast<std::size_t>(s)] = best_from;
    }
  }
  const auto& last = sum.back();
  auto s = static_cast<int>(std::max_element(last.begin(), last.end()) - last.begin());
  Outline out{};
  for (std::size_t n = sum.size(); n-- > 0;) {
    if (n / kOutlineRays == 1) out[n % kOutlineRays] = kNearest_mm + s * kRayStep_mm;
    s = from[n][static_cast<std::size_t>(s)];
  }
  return out;
}

double medianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The wall's brightest and the tissue beyond it, from the CT as it is: blurring would lower a thin shell.
void measureWall(const Polar& polar, Body& body) {
  std::vector<double> soft, wall;
  for (std::size_t ray = 0; ray < kOutlineRays; ++ray) {
    const int here = static_cast<int>(std::lround((body.outline_mm[ray] - kNearest_mm) / kRayStep_mm));
    double brightest = -1e9, beyond = 0;
    for (int s = here - 5; s <= here + 2; ++s) brightest = std::max(brightest, at(polar[ray], s));
    for (int s = here + 5; s <= here + 8; ++s) beyond += 0.25 * at(polar[ray], s);
    soft.push_back(beyond), wall.push_back(brightest);
  }
  body.soft_hu = medianOf(soft), body.wall_hu = medianOf(wall);
}

/// Height in the body's frame of a plane that passes through a plate.
struct PlateHeight {
  Vec3 middle, up;

  PlateHeight(const Frame& frame, const EndPlate& plate)
      : middle(frame.toLocal(plate.middle)), up(transposeTimes(frame.axes, plate.up)) {}
  [[nodiscard]] double over(double x, double y) const {
    return middle.z - (up.x * (x - middle.x) + up.y * (y - middle.y)) / up.z;
  }
};

/// Mean HU by angle and distance at one level, over a tenth of the height: a wedge's levels follow its plates.
Polar polarAtLevel(const Scene& scene, const Body& body, double part) {
  constexpr double kOff[5] = {-0.06, -0.03, 0, 0.03, 0.06};
  const PlateHeight top(body.frame, body.top), bottom(body.frame, body.bottom);
  Polar polar{};
  for (std::size_t ray = 0; ray < kOutlineRays; ++ray) {
    const SinCos a = angleOf(ray);
    for (int step = 0; step < kRaySteps; ++step) {
      const double r = kNearest_mm + step * kRayStep_mm, x = r * a.cos, y = r * a.sin;
      const double low = bottom.over(x, y), high = top.over(x, y);
      for (const double off : kOff) {
        const Vec3 p{x, y, low + (part + off) * (high - low)};
        polar[ray][static_cast<std::size_t>(step)] += 0.2 * valueAt(scene.block, scene.smooth, body.frame.toPatient(p));
      }
    }
  }
  return polar;
}

/// From the waist to each rim, level by level. A rim flares by no more than 45 degrees or so; at the back, where
/// pedicles leave the body, no wall is to be seen and the waist's stands for it.
void traceLevels(const Scene& scene, Body& body) {
  constexpr int kWaist = 2;
  constexpr double kBack = 0.3;  // sine of the angle from left or right
  const double flare = (partOfLevel(1) - partOfLevel(0)) * body.height_mm;
  const auto trace = [&](int level, const Outline& from) {
    Band band{from, from};
    for (std::size_t ray = 0; ray < kOutlineRays; ++ray) {
      const double loose = angleOf(ray).sin > kBack ? 0.5 * kRayStep_mm : flare;
      band.least[ray] -= loose, band.most[ray] += loose;
    }
    body.level_mm[static_cast<std::size_t>(level)] = closedWall(polarAtLevel(scene, body, partOfLevel(level)), band);
  };
  trace(kWaist, body.outline_mm);
  for (int n = kWaist - 1; n >= 0; --n) trace(n, body.level_mm[static_cast<std::size_t>(n + 1)]);
  for (int n = kWaist + 1; n < kOutlineLevels; ++n) trace(n, body.level_mm[static_cast<std::size_t>(n - 1)]);
}

}  // namespace

void traceOutline(const Scene& scene, const Ellipse& near, Body& body) {
  const double low = -0.3 * body.height_mm, high = 0.02 * body.height_mm;
  Band band;
  for (std::size_t ray = 0; ray < kOutlineRays; ++ray) {
    const double expected = radiusOf(near, angleOf(ray));
    band.least[ray] = 0.7 * expected, band.most[ray] = 1.3 * expected;
  }
  body.outline_mm = closedWall(polarMean(scene.block, scene.smooth, body.frame, low, high), band);
  traceLevels(scene, body);
  measureWall(polarMean(scene.block, scene.block.hu, body.frame, low, high), body);
  const auto towards = [&](int degrees) {
    return body.outline_mm[static_cast<std::size_t>(degrees * kOutlineRays / 360)];
  };
  body.half_width_mm = 0.5 * (towards(0) + towards(180));
  body.back_mm = (towards(80) + towards(90) + towards(100)) / 3;
}

}  // namespace spinaltap::segment
