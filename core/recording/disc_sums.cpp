#include "core/recording/disc_sums.h"

#include <algorithm>

#include "core/base/hash.h"

namespace spinaltap::recording {

void DiscSums::add(std::span<const std::uint32_t> removed, std::uint64_t cycle,
                   const point_volume::PointVolume& volume) {
  if (removed.empty()) return;
  sums_.resize(static_cast<std::size_t>(volume.lattice.discs));
  const std::uint64_t points = volume.lattice.pointsPerDisc();
  for (const std::uint64_t index : removed) {
    const std::uint64_t disc = index / points, word = index >> 6;
    // The rest of the word, because the state hash depends on it too; but only what is of the same disc.
    const std::uint64_t low = std::max(disc * points, word << 6) & 63,
                        high = std::min((disc + 1) * points - (word << 6), std::uint64_t{64});
    const std::uint64_t rest = (volume.alive[word] >> low) & (~0ull >> (64 - (high - low)));
    // A recording has at most 2^26 points; a point goes once, so 2^22 cycles before the number returns are plenty.
    const std::uint64_t what = index | (std::uint64_t{volume.density_mg_cm3[index]} << 26) | (cycle << 42);
    std::uint32_t& sum = sums_[disc];
    if (sum == 0) cut_.push_back(static_cast<std::uint32_t>(disc));
    sum += static_cast<std::uint32_t>(combine(what, rest));
  }
}

std::vector<DiscSum> DiscSums::take() {
  std::sort(cut_.begin(), cut_.end());
  std::vector<DiscSum> taken;
  for (const std::uint32_t disc : cut_) {
    if (sums_[disc] != 0) taken.push_back({disc, sums_[disc]});
    sums_[disc] = 0;
  }
  cut_.clear();
  return taken;
}

std::vector<std::uint32_t> differingDiscs(const std::vector<DiscSum>& a, const std::vector<DiscSum>& b) {
  std::vector<std::uint32_t> discs;
  auto left = a.begin(), right = b.begin();
  while (left != a.end() || right != b.end()) {
    if (right == b.end() || (left != a.end() && left->disc < right->disc)) {
      discs.push_back((left++)->disc);
    } else if (left == a.end() || right->disc < left->disc) {
      discs.push_back((right++)->disc);
    } else {
      if (left->sum != right->sum) discs.push_back(left->disc);
      ++left, ++right;
    }
  }
  return discs;
}

}  // namespace spinaltap::recording
