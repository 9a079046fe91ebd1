#include "core/rbf/octree.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/box.h"
#include "core/base/parallel.h"

namespace spinaltap::rbf {
namespace {

constexpr std::size_t kBlock = 50'000;  // points that one thread takes at a time
constexpr std::uint64_t kCells = std::uint64_t{1} << Octree::kDeepest;

/// Spreads 20 bits so that two zeros follow each.
std::uint64_t spread(std::uint64_t v) {
  v = (v | v << 32) & 0x1f00000000ffffULL;
  v = (v | v << 16) & 0x1f0000ff0000ffULL;
  v = (v | v << 8) & 0x100f00f00f00f00fULL;
  v = (v | v << 4) & 0x10c30c30c30c30c3ULL;
  return (v | v << 2) & 0x1249249249249249ULL;
}

std::uint64_t cellOf(double relative, double half) {
  const double share = (relative / half + 1.0) * 0.5 * static_cast<double>(kCells);
  return share <= 0 ? 0 : std::min(kCells - 1, static_cast<std::uint64_t>(share));
}

struct Keyed {
  std::uint64_t key;
  std::uint32_t index;
};

/// Stable, by one digit. Each block of items finds its own places, so that all can be moved at once.
void sortByDigit(std::vector<Keyed>& items, std::vector<Keyed>& other, int shift, int bits, unsigned threads) {
  const std::size_t digits = std::size_t{1} << bits, blocks = (items.size() + kBlock - 1) / kBlock;
  const auto digitOf = [&](const Keyed& i) { return static_cast<std::size_t>(i.key >> shift & (digits - 1)); };
  std::vector<std::uint32_t> places(blocks * digits, 0);
  parallelBlocks(items.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const own = places.data() + begin / kBlock * digits;
    for (std::size_t n = begin; n < end; ++n) ++own[digitOf(items[n])];
  });
  std::uint32_t next = 0;
  for (std::size_t digit = 0; digit < digits; ++digit)
    for (std::size_t block = 0; block < blocks; ++block) next += std::exchange(places[block * digits + digit], next);
  parallelBlocks(items.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const own = places.data() + begin / kBlock * digits;
    for (std::size_t n = begin; n < end; ++n) other[own[digitOf(items[n])]++] = items[n];
  });
  items.swap(other);
}

/// Stable, over the highest `bits` of 60, in as few passes as there can be of at most 12 bits.
void sortByHighBits(std::vector<Keyed>& items, int bits, unsigned threads) {
  constexpr int kMost = 12;
  const int passes = (bits + kMost - 1) / kMost;
  std::vector<Keyed> other(items.size());
  for (int pass = 0, shift = 3 * Octree::kDeepest - bits; pass < passes; ++pass) {
    const int digit = (bits + pass) / passes;  // shares of `bits` that differ by one at most
    sortByDigit(items, other, shift, digit, threads);
    shift += digit;
  }
}

}  // namespace

RootCube RootCube::around(std::span<const Vec3> a, std::span<const Vec3> b) {
  Box box = boxAround(a.empty() ? b : a);
  for (const Vec3& p : b) box.add(p);
  const auto& [low, high] = box;
  const Vec3 size = high - low;
  const double longest = std::max({size.x, size.y, size.z});
  // One point, or points that rounding cannot tell apart, still get a cube.
  const double floor = 1e-12 * (1.0 + std::max({std::abs(low.x), std::abs(low.y), std::abs(low.z)}));
  return {low + size * 0.5, std::max(0.5 * longest * (1 + 1e-9), floor)};
}

bool RootCube::holds(const Vec3& p) const {
  return std::abs(p.x - middle.x) <= half && std::abs(p.y - middle.y) <= half && std::abs(p.z - middle.z) <= half;
}

Octree::Octree(std::span<const Vec3> points, const RootCube& root, std::size_t leaf_size, int deepest) : root_(root) {
  std::vector<Keyed> items(points.size());
  const unsigned threads = points.size() > kBlock ? 0 : 1;
  parallelBlocks(points.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = points[i] - root.middle;
      const std::uint64_t x = cellOf(p.x, root.half), y = cellOf(p.y, root.half), z = cellOf(p.z, root.half);
      items[i] = {spread(x) | spread(y) << 1 | spread(z) << 2, static_cast<std::uint32_t>(i)};
    }
  });
  sortByHighBits(items, 3 * std::min(deepest, kDeepest), threads);
  std::vector<std::uint64_t> keys(items.size());
  order_.resize(items.size()), x_.resize(items.size()), y_.resize(items.size()), z_.resize(items.size());
  parallelBlocks(items.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      keys[n] = items[n].key, order_[n] = items[n].index;
      const Vec3 p = points[items[n].index] - root.middle;
      x_[n] = p.x, y_[n] = p.y, z_[n] = p.z;
    }
  });
  nodes_.push_back({0, {0, 0, 0}, 0, static_cast<std::uint32_t>(items.size()), -1, 0});
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    if (static_cast<std::size_t>(nodes_[n].level) == level_first_.size()) level_first_.push_back(n);
    split(n, keys, leaf_size, std::min(deepest, kDeepest));
  }
  level_first_.push_back(nodes_.size());
}

void Octree::split(std::size_t n, const std::vector<std::uint64_t>& keys, std::size_t leaf_size, int deepest) {
  const OctreeNode node = nodes_[n];
  if (node.count <= leaf_size || node.level >= deepest) return;
  const int shift = 3 * (kDeepest - node.level - 1);
  const auto begin = keys.begin() + node.first, end = begin + node.count;
  nodes_[n].children = static_cast<std::int32_t>(nodes_.size());
  auto from = begin;
  for (std::uint64_t octant = 0; octant < 8; ++octant) {
    const auto to = std::partition_point(from, end, [&](std::uint64_t key) { return (key >> shift & 7) <= octant; });
    if (to == from) continue;
    const auto bit = [&](int axis) { return static_cast<std::int32_t>(octant >> axis & 1); };
    nodes_.push_back({node.level + 1,
                      {2 * node.at[0] + bit(0), 2 * node.at[1] + bit(1), 2 * node.at[2] + bit(2)},
                      static_cast<std::uint32_t>(from - keys.begin()),
                      static_cast<std::uint32_t>(to - from),
                      -1,
                      0});
    ++nodes_[n].child_count;
    from = to;
  }
}

Vec3 Octree::middleOf(const OctreeNode& node) const {
  const double half = halfOf(node.level);
  const auto along = [&](std::size_t axis) { return (2 * static_cast<double>(node.at[axis]) + 1) * half - root_.half; };
  return {along(0), along(1), along(2)};
}

}  // namespace spinaltap::rbf
