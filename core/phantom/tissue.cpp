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

}  // namespace

Tissue Tissue::make(std::uint64_t seed, bool osteoporotic) {
  Tissue tissue;
  tissue.seed = mix64(seed ^ 0x7469737375ULL);
  if (osteoporotic) {
    tissue.shell_mm = 0.5;
    tissue.cortical_hu = 800;
    tissue.cancellous_low_hu = 65;
    tissue.cancellous_high_hu = 85;
  }
  return tissue;
}

double Tissue::hu(const Anatomy& anatomy, const Vec3& local, double bone_distance) const {
  if (bone_distance > 0) {
    if (canalDistance(anatomy, local) < 0) return 30;
    return 50 + 8 * noise(seed + 1, local, 6.0);
  }
  const double arch = smoothStep(13.0, 22.0, local.y);
  const double shell = shell_mm * mixed(1.0, 1.4, arch);
  const double endplate = smoothStep(0.3, 1.0, std::fabs(local.z) / anatomy.half_height);
  const double cancellous = mixed(cancellous_low_hu, cancellous_high_hu, endplate) + 12 * noise(seed + 2, local, 2.0);
  return mixed(cortical_hu, cancellous, smoothStep(shell - 0.15, shell + 0.15, -bone_distance));
}

}  // namespace spinaltap::phantom
