// core/segment/compete.h - rivals flood a block from their seeds; who reaches a voxel at the least cost owns it
// (internal to segment). After: Dijkstra (1959) with the buckets of Dial, "Algorithm 360", CACM 12 (1969).
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace spinaltap::segment {

inline constexpr std::uint8_t kNobody = 0xff;
inline constexpr std::uint16_t kWall = 0xffff;
inline constexpr std::uint32_t kAgainst = 4;

struct Flood {
  std::array<int, 3> dims{0, 0, 0};
  std::vector<std::uint16_t> cost;         ///< #voxels, in tenths a step: >= 1, kWall where nobody passes
  std::vector<std::uint8_t> owner;         ///< #voxels: seeds carry their owner, all else kNobody
  std::vector<std::uint16_t> start = {};   ///< #voxels: what a seed has spent when it sets out; empty: nothing
  std::vector<std::uint8_t> against = {};  ///< #voxels: owner o pays kAgainst times the cost where bit o is set
};

struct Flooded {
  std::vector<std::uint8_t> owner;     ///< #voxels, kNobody where no seed came
  std::vector<std::uint32_t> arrival;  ///< #voxels, the least sum of costs from a seed
};

/// A step costs the mean of its two voxels' costs times its length in steps (faces, edges and corners: 26 neighbours).
/// Of two that arrive at one cost the one popped first keeps the voxel; the order depends on the input alone.
/// @param most  nobody goes farther than this.
[[nodiscard]] Flooded compete(const Flood& flood, std::uint32_t most);

}  // namespace spinaltap::segment
