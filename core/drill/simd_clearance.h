// core/drill/simd_clearance.h - what the clearance engine knows of a point volume, and the loops over discs and rings
// that ask it. What they say errs towards too much; no result of a drill depends on their rounding.
// Private to core/drill and its tests.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/drill/section.h"

namespace spinaltap::drill {

/// Arrays are read up to so many elements past their last.
inline constexpr std::size_t kPadding = 16;

/// What is known of where no alive point is; true for good, since points only die.
template <class Slot>
struct Known {
  /// For each disc a circle without an alive point inside.
  float* x_mm;
  float* y_mm;
  float* radius_mm;
  /// For each disc its first ring that may have alive points.
  std::uint16_t* first_ring;
  /// For each ring of each disc: no slot strictly between `low` and `high`, going up, is alive; all but one, if equal.
  Slot* low;
  Slot* high;
  const float* half_slot_rad;  ///< for each ring half the angle between its slots
  int rings;
  float spacing_mm, rings_per_mm, margin_mm;  ///< the margin of Sections

  [[nodiscard]] std::size_t gap(int disc, int ring) const {
    return static_cast<std::size_t>(disc) * static_cast<std::size_t>(rings) + static_cast<std::size_t>(ring);
  }
};

/// A section's outer circle and its centre in polar form: distance from the path, and direction in turns, 0 .. 1.
struct Look {
  float outer_mm, away_mm, turn;
};

/// The rings that a circle crosses, and one more each way: first .. last; and the squared distance from its centre to
/// whatever lies on other rings, those from 0 to `whole` left out, which lie whole in the circle.
struct RingRange {
  int whole, first, last;
  float beyond_mm2;
};
template <class Slot>
[[nodiscard]] inline RingRange ringsNear(const Known<Slot>& known, int disc, const Look& look) {
  const float spacing = known.spacing_mm, outermost = static_cast<float>(known.rings - 1);
  const int first_ring = known.first_ring[disc];
  RingRange range{};
  // Both quotients are above -1 after the clamps, where truncation is as good as the floor, plus one.
  range.whole = static_cast<int>(std::min(std::max((look.outer_mm - look.away_mm) * known.rings_per_mm, -1.0F) + 1.0F,
                                          outermost + 1.0F)) -
                1;
  const float inner = std::max((look.away_mm - look.outer_mm) * known.rings_per_mm, 0.0F);
  range.first = std::max({first_ring, range.whole + 1, static_cast<int>(std::min(inner, outermost + 1.0F)), 1});
  range.last = static_cast<int>(std::min((look.away_mm + look.outer_mm) * known.rings_per_mm + 1.0F, outermost));
  range.beyond_mm2 = 1e18F;
  const auto consider = [&](float apart) { range.beyond_mm2 = std::min(range.beyond_mm2, apart * apart); };
  if (range.last < known.rings - 1) consider(static_cast<float>(range.last + 1) * spacing - look.away_mm);
  if (range.first - 1 > std::max(range.whole, first_ring - 1)) {
    consider(look.away_mm - static_cast<float>(range.first - 1) * spacing);
  }
  return range;
}

/// A disc whose section may hold alive points.
struct Touched {
  int disc, whole;      ///< rings up to `whole` lie whole in its outer circle
  int first, group;     ///< bit b of `rings` stands for rings first + b * group and the group - 1 after it:
  std::uint64_t rings;  ///< set where points of them may be in the circle
  float beyond_mm2;     ///< squared distance from the section's centre to whatever is alive on other rings
  float turn;           ///< the direction of the centre
  About about;          ///< whose circle it is
};

/// Of discs first .. first + count - 1, writes to `touched`, ascending, those whose sections may hold alive points, and
/// returns how many; the others are known to be clear, and their circles are renewed where they were used up.
/// `line` counts from `first`. @pre count <= kMostDiscs.
inline constexpr int kMostDiscs = 256;
int findTouched(const SectionLine& line, const Known<std::uint8_t>& known, int first, int count, Touched* touched);
int findTouched(const SectionLine& line, const Known<std::uint16_t>& known, int first, int count, Touched* touched);

}  // namespace spinaltap::drill
