#include "core/drill/simd_hand_out.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/drill/simd_hand_out.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spinaltap::drill::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<std::uint32_t>;

/// Returns what each lane adds up.
HWY_INLINE hn::Vec<D> Row(std::uint32_t count, std::uint32_t first, const std::uint16_t* density, std::uint32_t* to) {
  const D d;
  const hn::Rebind<std::uint16_t, D> dh;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
  const auto from_0 = hn::Iota(d, 0);  // a constant; from any other number on it is made in memory
  auto sums = hn::Zero(d);
  for (std::uint32_t i = 0; i < count; i += lanes) {
    hn::StoreU(hn::Add(from_0, hn::Set(d, first + i)), d, to + i);
    const auto values = hn::PromoteTo(d, hn::LoadU(dh, density + i));
    sums = hn::Add(sums, hn::IfThenElseZero(hn::FirstN(d, count - i), values));
  }
  return sums;
}

HandedOut HandOut(std::uint64_t bits, std::uint32_t first, const std::uint16_t* density, std::uint32_t* to) {
  const D d;
  auto sums = hn::Zero(d);
  std::uint32_t count = 0, sum = 0;
  while (bits != 0) {
    const auto place = static_cast<std::uint32_t>(__builtin_ctzll(bits));
    const std::uint64_t from_place = bits >> place;
    if ((from_place & 0xf) != 0xf) {
      to[count++] = first + place;
      sum += density[place];
      bits &= bits - 1;
      continue;
    }
    const std::uint32_t run = ~from_place == 0 ? 64 : static_cast<std::uint32_t>(__builtin_ctzll(~from_place));
    sums = hn::Add(sums, Row(run, first + place, density + place, to + count));
    count += run;
    bits &= ~((~std::uint64_t{0} >> (64 - run)) << place);
  }
  return {count, sum + hn::GetLane(hn::SumOfLanes(d, sums))};
}

std::uint32_t HandOutRow(std::uint32_t count, std::uint32_t first, const std::uint16_t* density, std::uint32_t* to) {
  return hn::GetLane(hn::SumOfLanes(D(), Row(count, first, density, to)));
}

}  // namespace spinaltap::drill::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spinaltap::drill {

HWY_EXPORT(HandOut);
HWY_EXPORT(HandOutRow);

HandedOut handOut(std::uint64_t bits, std::uint32_t first, const std::uint16_t* density, std::uint32_t* to) {
  return HWY_DYNAMIC_DISPATCH(HandOut)(bits, first, density, to);
}
std::uint32_t handOutRow(std::uint32_t count, std::uint32_t first, const std::uint16_t* density, std::uint32_t* to) {
  return HWY_DYNAMIC_DISPATCH(HandOutRow)(count, first, density, to);
}

}  // namespace spinaltap::drill
#endif
