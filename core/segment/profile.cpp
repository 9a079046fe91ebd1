#include "core/segment/profile.h"

#include <algorithm>

namespace spinaltap::segment {
namespace {

constexpr double kMostFace_hu = 250;  // so that one bright wall does not outvote the others
constexpr double kDisc_hu = 120;      // discs have 60 to 120, worn ones more by partial volume

/// The deepest narrow valley before each mm of a profile: how far the HU drop and rise again within 7 mm. Whoever has
/// passed one has passed a worn disc.
std::vector<double> valleysBefore(const std::vector<double>& profile) {
  constexpr std::size_t kWidest = 7;
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

}  // namespace

std::vector<double> patchProfile(const Block& block, const std::vector<float>& values, const Vec3& from,
                                 const Vec3& out, const Patch& patch, double farthest_mm) {
  std::vector<double> profile;
  for (double t = 0; t <= farthest_mm + 2; t += 1) {
    if (!isKnown(block, from + out * t)) break;
    double sum = 0;
    int count = 0;
    for (double a = -patch.half_u; a <= patch.half_u; a += 3) {
      for (double b = -patch.half_v; b <= patch.half_v; b += 3, ++count) {
        const Vec3 p = from + out * t + patch.u * a + patch.v * (b + patch.shift_v);
        sum += std::clamp(valueAt(block, values, p), -100.0, 600.0);
      }
    }
    profile.push_back(sum / count);
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

/// The drop from bone into the disc counts, and the rise to the neighbour's plate beyond it: so a plate with a
/// neighbour beats every other edge, and one without (the last in the scan) is still found.
Face firstDisc(const std::vector<double>& profile, int nearest_mm, int farthest_mm) {
  constexpr int kPlate = 2, kDisc = 14, kNear = 4;
  const int size = static_cast<int>(profile.size());
  const auto hu = [&](int t) { return profile[static_cast<std::size_t>(t)]; };
  const std::vector<double> valleys = valleysBefore(profile);
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
