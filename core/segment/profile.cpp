#include "core/segment/profile.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace spinaltap::segment {
namespace {

constexpr double kMostFace_hu = 250;  // so that one bright wall does not outvote the others
constexpr double kDisc_hu = 120;      // discs have 60 to 120, worn ones more by partial volume

constexpr float kDarkest_hu = -100, kBrightest_hu = 600;

/// valueAt in single precision. @pre 0 <= x < nx - 1 and so on: this is where the search for bodies spends its time.
float valueWithin(const float* values, const std::array<int, 3>& dims, float x, float y, float z) {
  const int i = static_cast<int>(x), j = static_cast<int>(y), k = static_cast<int>(z);
  const float a = x - static_cast<float>(i), b = y - static_cast<float>(j), c = z - static_cast<float>(k);
  const std::ptrdiff_t row = dims[0], layer = row * dims[1];
  const float* p = values + (i + row * j + layer * k);
  const auto along = [&](const float* q) { return q[0] + a * (q[1] - q[0]); };
  const auto plane = [&](const float* q) { return along(q) + b * (along(q + row) - along(q)); };
  return plane(p) + c * (plane(p + layer) - plane(p));
}

bool isWithin(const Block& block, const Vec3& v) {
  return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < block.dims[0] - 1.001 && v.y < block.dims[1] - 1.001 &&
         v.z < block.dims[2] - 1.001;
}

double patchMean(const Block& block, const std::vector<float>& values, const Vec3& middle, const Patch& patch) {
  constexpr double kPitch_mm = 3;
  const Vec3 centre = middle + patch.v * patch.shift_v;
  const Vec3 u = patch.u * patch.half_u, v = patch.v * patch.half_v;
  bool within = true;
  for (const Vec3& corner : {u + v, u - v, v - u, -u - v}) {
    within = within && isWithin(block, block.voxelAt(centre + corner));
  }
  double sum = 0;
  int count = 0;
  for (double a = -patch.half_u; a <= patch.half_u; a += kPitch_mm) {
    for (double b = -patch.half_v; b <= patch.half_v; b += kPitch_mm, ++count) {
      const Vec3 place = centre + patch.u * a + patch.v * b;
      const Vec3 at = block.voxelAt(place);
      const float hu = within ? valueWithin(values.data(), block.dims, static_cast<float>(at.x),
                                            static_cast<float>(at.y), static_cast<float>(at.z))
                              : static_cast<float>(valueAt(block, values, place));
      sum += std::clamp(hu, kDarkest_hu, kBrightest_hu);
    }
  }
  return sum / count;
}

}  // namespace

std::vector<double> patchProfile(const Block& block, const std::vector<float>& values, const Vec3& from,
                                 const Vec3& out, const Patch& patch, double farthest_mm) {
  std::vector<double> profile;
  for (double t = 0; t <= farthest_mm + 2; t += 1) {
    if (!isKnown(block, from + out * t)) break;
    profile.push_back(patchMean(block, values, from + out * t, patch));
  }
  return profile;
}

/// Whoever goes on beyond the body meets other things from behind: a rise, which counts against all that lies beyond it
/// (the shell's own inner side, up to 4 mm before the drop, is no such rise).
std::vector<double> dropsAlong(const std::vector<double>& profile) {
  constexpr int kIn = 1, kOut = 2, kShell = 4;
  std::vector<double> drops(profile.size(), 0);
  double rise = 0;
  const auto drop = [&](int t) {
    return profile[static_cast<std::size_t>(t - kIn)] - profile[static_cast<std::size_t>(t + kOut)];
  };
  for (int t = kIn; t + kOut < static_cast<int>(profile.size()); ++t) {
    if (t - kShell >= kIn) rise = std::max(rise, -drop(t - kShell));
    drops[static_cast<std::size_t>(t)] = std::min(drop(t), kMostFace_hu) - rise;
  }
  return drops;
}

std::vector<double> valleysBefore(const std::vector<double>& profile) {
  constexpr std::size_t kWidest = 11;
  std::vector<double> valleys(profile.size(), 0);
  for (std::size_t t = 1; t < profile.size(); ++t) {
    double lowest = profile[t], deepest = valleys[t - 1];
    for (std::size_t back = 1; back <= std::min(t, kWidest); ++back) {
      const std::size_t q = t - back;
      lowest = std::min(lowest, profile[q]);
      deepest = std::max(deepest, std::min(profile[q], profile[t]) - lowest);
    }
    valleys[t] = deepest;
  }
  return valleys;
}

/// The drop from bone into the disc counts, and the rise to the neighbour's plate beyond it: so a plate with a
/// neighbour beats every other edge, and one without (the last in the scan) is still found.
Face firstDisc(const std::vector<double>& profile, const std::vector<double>& valleys, int nearest_mm,
               int farthest_mm) {
  constexpr int kPlate = 2, kDisc = 14, kNear = 4;
  const int size = static_cast<int>(profile.size());
  const auto hu = [&](int t) { return profile[static_cast<std::size_t>(t)]; };
  Face best;
  for (int t = std::max(kPlate, nearest_mm); t + 2 < size && t <= farthest_mm; ++t) {
    const double plate = std::max({hu(t), hu(t - 1), hu(t - 2)});
    double lowest = hu(t + 1), near = lowest, both = -1e9;
    for (int q = t + 1; q < std::min(size, t + kDisc); ++q) {
      lowest = std::min(lowest, hu(q));
      if (q <= t + kNear) near = lowest;
      both = std::max(both, std::min(plate, hu(q)) - lowest);
    }
    const double value = 0.4 * std::min(plate - near, kMostFace_hu) + std::min(both, kMostFace_hu) -
                         valleys[static_cast<std::size_t>(t)] - 0.5 * std::max(0.0, near - kDisc_hu);
    if (value > best.drop_hu) best = {1.0 * t, value};
  }
  if (best.drop_hu <= 0 && size >= nearest_mm && size - 1 < farthest_mm) best = {1.0 * (size - 1), kCutFace_hu};
  return best;
}

}  // namespace spinaltap::segment
