#include "core/rbf/direct_sum.h"

#include <algorithm>

#include "core/base/parallel.h"

namespace spinaltap::rbf {
namespace {

constexpr std::size_t kTile = 512;   // points whose distances are taken at a time
constexpr std::size_t kRows = 64;    // and of those whose sources are others
constexpr std::size_t kGroups = 16;  // each with sums of its own: added in order, whoever made them

}  // namespace

Coordinates::Coordinates(std::span<const Vec3> points, const Vec3& origin) {
  x.reserve(points.size()), y.reserve(points.size()), z.reserve(points.size());
  for (const Vec3& p : points) x.push_back(p.x - origin.x), y.push_back(p.y - origin.y), z.push_back(p.z - origin.z);
}

std::vector<double> distancesAmong(const Coordinates& points, std::span<const double> weights, unsigned threads) {
  const std::size_t n = points.size(), tiles = (n + kTile - 1) / kTile;
  const std::size_t groups = std::min(kGroups, tiles);
  std::vector<std::vector<double>> sums(groups);
  const auto end_of = [&](std::size_t tile) { return std::min(n, (tile + 1) * kTile); };
  parallelBlocks(groups, 1, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t g = begin; g < end; ++g) {
      std::vector<double>& out = sums[g];
      out.assign(n, 0.0);
      for (std::size_t a = g; a < tiles; a += groups) {
        const PointArrays<double> own = points.part(a * kTile, end_of(a));
        addDistances(own, own, weights.data() + a * kTile, out.data() + a * kTile);
        const std::size_t next = end_of(a);
        if (next < n) {
          addDistancesBothWays(own, weights.data() + a * kTile, out.data() + a * kTile, points.part(next, n),
                               weights.data() + next, out.data() + next);
        }
      }
    }
  });
  std::vector<double> out(n, 0.0);
  for (const std::vector<double>& part : sums)
    for (std::size_t i = 0; i < n; ++i) out[i] += part[i];
  return out;
}

std::vector<double> distancesFrom(const Coordinates& points, const Coordinates& sources,
                                  std::span<const double> weights, unsigned threads) {
  std::vector<double> out(points.size(), 0.0);
  parallelBlocks(points.size(), kRows, threads, [&](std::size_t begin, std::size_t end) {
    addDistances(points.part(begin, end), sources.part(0, sources.size()), weights.data(), out.data() + begin);
  });
  return out;
}

}  // namespace spinaltap::rbf
