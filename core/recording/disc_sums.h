// core/recording/disc_sums.h - what a stretch of cycles removed on each disc, in 32 bits a disc, so that two runs which
// removed anything else, or the same at other cycles or of other densities, or beside other points, can tell on which
// discs. Layout of what is summed: FORMAT.md, "Sums of discs".
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "core/point_volume/point_volume.h"

namespace spinaltap::recording {

/// Order-independent within a cycle; equal sums of different removals: one in 2^32.
struct DiscSum {
  std::uint32_t disc = 0;  ///< 0 .. discs - 1
  std::uint32_t sum = 0;
  friend bool operator==(const DiscSum&, const DiscSum&) = default;
};

class DiscSums {
 public:
  /// `volume` is as it is after `cycle`, which removed these points.
  void add(std::span<const std::uint32_t> removed, std::uint64_t cycle, const point_volume::PointVolume& volume);
  /// The discs cut since the last call, in order; then all begins at nothing again.
  [[nodiscard]] std::vector<DiscSum> take();

 private:
  std::vector<std::uint32_t> sums_;  ///< of each disc
  std::vector<std::uint32_t> cut_;   ///< discs that have a sum, maybe twice
};

/// The discs whose sums differ, in order. @pre both are in order.
[[nodiscard]] std::vector<std::uint32_t> differingDiscs(const std::vector<DiscSum>& a, const std::vector<DiscSum>& b);

}  // namespace spinaltap::recording
