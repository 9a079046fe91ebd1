#include "core/phantom/tissue.h"

#include <algorithm>
#include <cmath>

#include "core/base/hash.h"
#include "core/phantom/shapes.h"

namespace spinaltap::phantom {
namespace {

/// Smooth noise in [-1, 1]: random values at the corners of cells `cell` mm wide, blended between.
double noise(std::uint64_t seed, const Vec3& p, double cell) {
  const double x = p.x / cell, y = p.y / cell, z = p.z / cell;
  const double fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
  const double tx = smoothStep(0, 1, x - fx), ty = smoothStep(0, 1, y - fy), tz = smoothStep(0, 1, z - fz);
  const auto i = static_cast<std::uint64_t>(static_cast<std::int64_t>(fx));
  const auto j = static_cast<std::uint64_t>(static_cast<std::int64_t>(fy));
  const auto k = static_cast<std::uint64_t>(static_cast<std::int64_t>(fz));
  const auto corner = [&](std::uint64_t di, std::uint64_t dj, std::uint64_t dk) {
    const std::uint64_t h =
        mix64(seed ^ ((i + di) * 0x8da6b343ULL + (j + dj) * 0xd8163841ULL + (k + dk) * 0xcb1ab31fULL));
    return static_cast<double>(h >> 11) * 0x1p-52 - 1.0;
  };
  const auto row = [&](std::uint64_t dj, std::uint64_t dk) {
    const double a = corner(0, dj, dk);
    return a + (corner(1, dj, dk) - a) * tx;
  };
  const auto sheet = [&](std::uint64_t dk) {
    const double a = row(0, dk);
    return a + (row(1, dk) - a) * ty;
  };
  const double a = sheet(0);
  return a + (sheet(1) - a) * tz;
}

double mixed(double a, double b, double t) { return a + (b - a) * t; }

/// An ellipse in the transverse plane: below 1 inside.
double ellipse(const Vec3& p, double x, double y, double a, double b) {
  const double u = (p.x - x) / a, v = (p.y - y) / b;
  return std::sqrt(u * u + v * v);
}

constexpr double kFat = -95, kAir = -1000;

}  // namespace

double Tissue::shellThickness(const Vec3& local) const {
  const double arch = smoothStep(14.0, 21.0, local.y);
  return mixed(1.0, 1.5, arch) * (osteoporotic ? 0.5 : 1.0);
}

double Tissue::boneHu(const Anatomy& anatomy, const Vec3& local, double depth_mm) const {
  const double arch = smoothStep(14.0, 21.0, local.y);
  const double shell = shellThickness(local);
  const double inside = smoothStep(shell - 0.2, shell + 0.2, depth_mm);
  const double dense = std::max(0.8 * arch, smoothStep(0.25, 0.9, std::fabs(local.z) / anatomy.half_height));
  const double grain = inside > 0 ? 0.65 * noise(seed + 2, local, 1.7) + 0.35 * noise(seed + 3, local, 5.0) : 0.0;
  const double cancellous = osteoporotic ? mixed(68, 80, dense) + 11 * grain : mixed(160, 205, dense) + 30 * grain;
  const double cortical =
      mixed(osteoporotic ? 700 : 820, osteoporotic ? 900 : 1080, arch) + 90 * noise(seed + 4, local, 6.0);
  const double low = osteoporotic ? 60 : 140, high = osteoporotic ? 90 : 230;
  return mixed(cortical, std::clamp(cancellous, low, high), inside);
}

double Tissue::softHu(const Anatomy& an, const Vec3& p) const {
  const double skin = ellipse(p, 0, -16, 165, 113);
  if (skin > 1) return kAir;
  if (skin > 0.985) return 20;
  const double ripple = noise(seed + 5, p, 14.0), grain = 5 * noise(seed + 6, p, 4.0);
  if (skin > 0.86 + 0.03 * ripple) return kFat + grain;                                       // under the skin
  if (std::fabs(p.z) > 0.75 * an.half_height && bodyOutline(an, p) < 0.3) return 80 + grain;  // discs
  if (canalDistance(an, p) < 0.4 && bodyOutline(an, p) > -1) {
    const bool sac = ellipse(p, 0, an.canal_apex_y - 9.5, 9.6, 6.6) < 1;
    return sac ? 30 + grain : 12 + grain;  // fat and vessels around the sac, in part
  }
  if (ellipse(p, 8, -31, 9.5, 9.5) < 1 || ellipse(p, -16, -30, 12, 9) < 1) return 44 + grain;  // aorta, vena cava
  const double x = std::fabs(p.x);
  if (ellipse({x, p.y, 0}, 38, 9, 16.5 + 2 * ripple, 20) < 1) return 54 + grain;  // psoas
  if (p.y > 24) {
    // Back muscles: two masses a side, with fat between them and the spinous process's ligaments in the middle.
    const bool inner = ellipse({x, p.y, 0}, 19, 54, 16.5 + ripple, 22) < 1;
    const bool outer = ellipse({x, p.y, 0}, 51, 52, 23, 21 + 2 * ripple) < 1 && !inner;
    const double streak = noise(seed + 7, {p.x, p.y, 0.3 * p.z}, 6.0);
    if ((inner || outer) && streak < 0.62) return 52 + grain;
    if (x < 2.6 && p.y < an.spinous_tip_y + 4) return 46 + grain;
    return kFat + grain;
  }
  const Vec3 turned{0.8 * p.x + 0.6 * p.y, 0.8 * p.y - 0.6 * p.x, p.z};
  if (p.y < -20 && noise(seed + 8, turned, 24.0) + 0.4 * noise(seed + 9, p, 11.0) > 0.1)
    return 40 + grain;  // bowel among fat
  return kFat + grain;
}

}  // namespace spinaltap::phantom
