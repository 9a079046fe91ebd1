#include "core/segment/flood.h"

#include <algorithm>
#include <cassert>

namespace spinaltap::segment {
namespace {

/// Calls use(neighbour) for the up to six voxels that share a face with v.
template <class Use>
void eachNeighbour(const Mask& mask, std::size_t v, const Use& use) {
  const auto row = static_cast<std::size_t>(mask.dims[0]);
  const std::size_t slice = row * static_cast<std::size_t>(mask.dims[1]);
  const std::size_t i = v % row, j = v / row % static_cast<std::size_t>(mask.dims[1]), k = v / slice;
  if (i > 0) use(v - 1);
  if (i + 1 < row) use(v + 1);
  if (j > 0) use(v - row);
  if (j + 1 < static_cast<std::size_t>(mask.dims[1])) use(v + row);
  if (k > 0) use(v - slice);
  if (k + 1 < static_cast<std::size_t>(mask.dims[2])) use(v + slice);
}

}  // namespace

std::vector<std::size_t> takeConnected(Mask& mask, std::size_t start, std::size_t most) {
  assert(mask.set[start] == 1);
  std::vector<std::size_t> found{start};
  mask.set[start] = 0;
  for (std::size_t next = 0; next < found.size() && found.size() <= most; ++next) {
    eachNeighbour(mask, found[next], [&](std::size_t n) {
      if (mask.set[n] == 0) return;
      mask.set[n] = 0;
      found.push_back(n);
    });
  }
  return found;
}

void fillHoles(Mask& mask) {
  std::vector<std::uint8_t> outside(mask.set.size(), 0);
  std::vector<std::size_t> open;
  const auto reach = [&](std::size_t v) {
    if (mask.set[v] != 0 || outside[v] != 0) return;
    outside[v] = 1;
    open.push_back(v);
  };
  for (int k = 0; k < mask.dims[2]; ++k) {
    for (int j = 0; j < mask.dims[1]; ++j) {
      const bool border = k == 0 || j == 0 || k == mask.dims[2] - 1 || j == mask.dims[1] - 1;
      for (int i = 0; i < mask.dims[0]; i += border ? 1 : std::max(1, mask.dims[0] - 1)) reach(mask.index(i, j, k));
    }
  }
  while (!open.empty()) {
    const std::size_t v = open.back();
    open.pop_back();
    eachNeighbour(mask, v, reach);
  }
  for (std::size_t v = 0; v < outside.size(); ++v) mask.set[v] = outside[v] != 0 ? 0 : 1;
}

}  // namespace spinaltap::segment
