#include "core/segment/compete.h"

#include <algorithm>
#include <cstddef>

namespace spinaltap::segment {
namespace {

struct Step {
  std::ptrdiff_t offset;
  int i, j, k;
  std::uint32_t length;  // in 1 / 16 of a step
};

std::vector<Step> stepsOf(const std::array<int, 3>& dims) {
  constexpr std::uint32_t kLength[4] = {0, 16, 23, 28};  // 1, sqrt 2, sqrt 3
  std::vector<Step> steps;
  for (int k = -1; k <= 1; ++k) {
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        const int axes = (i != 0) + (j != 0) + (k != 0);
        if (axes > 0)
          steps.push_back({i + dims[0] * (j + static_cast<std::ptrdiff_t>(dims[1]) * k), i, j, k, kLength[axes]});
      }
    }
  }
  return steps;
}

}  // namespace

Flooded compete(const Flood& flood, std::uint32_t most) {
  const int nx = flood.dims[0], ny = flood.dims[1], nz = flood.dims[2];
  const std::vector<Step> steps = stepsOf(flood.dims);
  Flooded out{flood.owner, std::vector<std::uint32_t>(flood.owner.size(), UINT32_MAX)};
  std::vector<std::vector<std::uint32_t>> buckets(most + 1);
  for (std::size_t v = 0; v < flood.owner.size(); ++v) {
    if (flood.owner[v] == kNobody) continue;
    const std::uint32_t start = flood.start.empty() ? 0 : std::min<std::uint32_t>(flood.start[v], most);
    out.arrival[v] = start;
    buckets[start].push_back(static_cast<std::uint32_t>(v));
  }
  for (std::uint32_t now = 0; now <= most; ++now) {
    for (std::size_t n = 0; n < buckets[now].size(); ++n) {  // it may grow meanwhile
      const std::uint32_t v = buckets[now][n];
      if (out.arrival[v] != now) continue;  // reached at less cost since
      const int i = static_cast<int>(v) % nx, j = static_cast<int>(v) / nx % ny, k = static_cast<int>(v) / nx / ny;
      for (const Step& s : steps) {
        if (i + s.i < 0 || i + s.i >= nx || j + s.j < 0 || j + s.j >= ny || k + s.k < 0 || k + s.k >= nz) continue;
        const auto w = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(v) + s.offset);
        if (flood.cost[w] == kWall) continue;
        const bool against = !flood.against.empty() && ((flood.against[w] >> out.owner[v]) & 1U) != 0;
        const std::uint32_t step = std::max(1U, ((flood.cost[v] + flood.cost[w]) * s.length) / 32);
        const std::uint32_t then = now + (against ? kAgainst * step : step);
        if (then >= out.arrival[w] || then > most) continue;
        out.arrival[w] = then;
        out.owner[w] = out.owner[v];
        buckets[then].push_back(static_cast<std::uint32_t>(w));
      }
    }
    std::vector<std::uint32_t>().swap(buckets[now]);
  }
  return out;
}

}  // namespace spinaltap::segment
