#include "core/surface/ct_edge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/volume/sample.h"

namespace spinaltap::surface {
namespace {

constexpr double kStep_mm = 0.1;
// The cortex's peak and the tissue's level are sought this far from the steepest place, beyond the blur of a voxel.
constexpr double kPlateau_mm = 1.2;
// Profiles are averaged over a small disc: a third of the noise goes, and on a rounding of 3 mm radius the disc's
// sagitta is below 0.03 mm.
constexpr double kDisc_mm = 0.4;

/// How far a voxel reaches along a direction.
double voxelAlong(const volume::Grid& grid, const Vec3& n) {
  const Vec3& s = grid.spacing_mm;
  return norm({n.x * s.x, n.y * s.y, n.z * s.z});
}

std::array<Vec3, 7> discAcross(const Vec3& normal) {
  const Vec3 helper = std::abs(normal.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 u = normalized(cross(normal, helper)), v = cross(normal, u);
  std::array<Vec3, 7> out{};
  constexpr double kCos60 = 0.5, kSin60 = 0.8660254037844386;
  const double around[6][2] = {{1, 0},  {kCos60, kSin60},   {-kCos60, kSin60},
                               {-1, 0}, {-kCos60, -kSin60}, {kCos60, -kSin60}};
  for (std::size_t i = 0; i < 6; ++i) out[i + 1] = (u * around[i][0] + v * around[i][1]) * kDisc_mm;
  return out;
}

/// Mean HU over the disc at offsets first, first + step, ...
std::vector<double> profileOf(const volume::CtVolume& ct, const Vec3& place, const Vec3& normal, double first,
                              std::size_t count) {
  const std::array<Vec3, 7> disc = discAcross(normal);
  const Vec3& s = ct.grid.spacing_mm;
  std::vector<double> out(count, 0.0);
  for (std::size_t n = 0; n < count; ++n) {
    const Vec3 middle = place + normal * (first + kStep_mm * static_cast<double>(n));
    for (const Vec3& d : disc) {
      const Vec3 p = middle + d;
      out[n] += volume::sampleHuAtVoxel(ct, {p.x / s.x, p.y / s.y, p.z / s.z});
    }
    out[n] /= static_cast<double>(disc.size());
  }
  return out;
}

/// The steepest fall over three steps either way, among the places [low, high].
std::size_t steepestFall(const std::vector<double>& hu, std::size_t low, std::size_t high) {
  std::size_t best = low;
  double fall = -1;
  for (std::size_t n = low; n <= high; ++n) {
    const double here = hu[n - 3] - hu[n + 3];
    if (here > fall) fall = here, best = n;
  }
  return best;
}

}  // namespace

std::optional<double> findCtEdge(const volume::CtVolume& ct, const Vec3& place_mm, const Vec3& normal,
                                 const BoundaryOptions& options) {
  const double voxel = voxelAlong(ct.grid, normal);
  const auto steps = [](double mm) { return static_cast<std::size_t>(std::ceil(mm / kStep_mm)); };
  const std::size_t reach = steps(options.reach_voxels * voxel), window = steps(kPlateau_mm + voxel) + 3;
  const std::size_t middle = reach + window, count = 2 * middle + 1;
  const double first = -kStep_mm * static_cast<double>(middle);
  const std::vector<double> hu = profileOf(ct, place_mm, normal, first, count);
  const std::size_t edge = steepestFall(hu, middle - reach, middle + reach);
  const auto at = hu.begin() + static_cast<std::ptrdiff_t>(edge);
  const auto span = static_cast<std::ptrdiff_t>(window);
  const double peak = *std::max_element(at - span, at + 1), valley = *std::min_element(at, at + span + 1);
  if (peak - valley < options.minimum_contrast_hu) return std::nullopt;
  // From the steepest place towards the level, whichever side it lies on.
  const double level = 0.5 * (peak + valley);
  std::size_t n = edge;
  while (n + 1 < count && hu[n] >= level && hu[n + 1] >= level) ++n;
  while (n > 0 && hu[n] < level) --n;
  if (n + 1 >= count || !(hu[n] >= level && hu[n + 1] < level)) return std::nullopt;
  const double offset = first + kStep_mm * (static_cast<double>(n) + (hu[n] - level) / (hu[n] - hu[n + 1]));
  if (std::abs(offset) > options.reach_voxels * voxel) return std::nullopt;
  return offset;
}

}  // namespace spinaltap::surface
