// All of core/drill that is compiled for each vector width: simd_clearance.h, simd_hand_out.h and simd_probe.h. One
// file, since foreach_target.h can be included only once where all sources are one (tests/determinism).
#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/base/dmath.h"
#include "core/drill/simd_clearance.h"
#include "core/drill/simd_hand_out.h"
#include "core/drill/simd_probe.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/drill/simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// No MulAdd: where it is fused, a disc would be looked at in one vector width and not in another, and counts differ.
HWY_BEFORE_NAMESPACE();
namespace spinaltap::drill::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;

/// first, first + 1, ..
HWY_INLINE hn::Vec<DI> From(int first) { return hn::Add(hn::Iota(DI(), 0), hn::Set(DI(), first)); }

template <class Tag, class X, std::size_t kTerms>
HWY_INLINE X Series(Tag d, X x, const float (&terms)[kTerms]) {
  X sum = hn::Set(d, terms[0]);
  for (std::size_t n = 1; n < kTerms; ++n) sum = hn::Add(hn::Mul(sum, x), hn::Set(d, terms[n]));
  return sum;
}

// Over t and its odd powers, t in 0 .. 1, from the highest down. Abramowitz and Stegun, Handbook of Mathematical
// Functions, 4.4.49 (error 2e-8 rad).
constexpr double kArctangent[] = {0.0028662257, -0.0161657367, 0.0429096138, -0.0752896400, 0.1065626393, -0.1420889944,
                                  0.1999355085, -0.3333314528, 1.0};

/// Of (x, y) in turns, 0 .. 1.
HWY_INLINE V Turn(V x, V y) {
  const D d;
  const V a = hn::Abs(x), b = hn::Abs(y), one = hn::Set(d, 1.0F), zero = hn::Zero(d);
  const V t = hn::Div(hn::Min(a, b), hn::Max(hn::Max(a, b), hn::Set(d, 1e-30F)));
  const V q = hn::Mul(t, t);
  V series = hn::Set(d, static_cast<float>(kArctangent[0]));
  for (std::size_t n = 1; n < std::size(kArctangent); ++n)
    series = hn::Add(hn::Mul(series, q), hn::Set(d, static_cast<float>(kArctangent[n])));
  const V acute = hn::Mul(hn::Mul(series, t), hn::Set(d, 0.159154943F));
  const V in_quarter = hn::IfThenElse(hn::Gt(b, a), hn::Sub(hn::Set(d, 0.25F), acute), acute);
  const V in_half = hn::IfThenElse(hn::Lt(x, zero), hn::Sub(hn::Set(d, 0.5F), in_quarter), in_quarter);
  return hn::IfThenElse(hn::Lt(y, zero), hn::Sub(one, in_half), in_half);
}

// A section seldom crosses more rings than that.
using DR = hn::CappedTag<float, 8>;
using DRI = hn::RebindToSigned<DR>;
using VR = hn::Vec<DR>;

/// first, first + 1, ..
HWY_INLINE VR RingsFrom(int first) { return hn::ConvertTo(DR(), hn::Add(hn::Iota(DRI(), 0), hn::Set(DRI(), first))); }

/// The squared distances from a centre to what may be alive on as many rings as there are lanes.
template <class Slot>
HWY_INLINE VR Squared(const Known<Slot>& known, std::size_t gap, const Look& look, int ring) {
  const DR d;
  const hn::Rebind<Slot, DR> dn;
  const VR zero = hn::Zero(d);
  const VR low = hn::ConvertTo(d, hn::PromoteTo(DRI(), hn::LoadU(dn, known.low + gap)));
  const VR high = hn::ConvertTo(d, hn::PromoteTo(DRI(), hn::LoadU(dn, known.high + gap)));
  const VR k = RingsFrom(ring), slots = hn::Mul(k, hn::Set(d, 6.0F));
  const VR between = hn::Sub(high, low), past = hn::Sub(hn::Mul(hn::Set(d, look.turn), slots), low);
  const VR width = hn::Add(between, hn::IfThenElse(hn::Le(between, zero), slots, zero));
  const VR from_low = hn::Add(past, hn::IfThenElse(hn::Lt(past, zero), slots, zero));
  // The nearest alive slot is an end of the gap if the centre's direction lies in it; else it may be anywhere.
  const VR nearest = hn::Min(hn::Min(from_low, hn::Sub(width, from_low)), hn::Mul(slots, hn::Set(d, 0.5F)));
  const VR half_angle = hn::Mul(hn::Max(nearest, zero), hn::LoadU(d, known.half_slot_rad + ring));
  // The sine on 0 .. pi/2 by its series up to x^11: it falls short by less than 6e-8.
  constexpr float kTerms[] = {-2.5052108e-8F, 2.7557319e-6F, -1.9841270e-4F, 8.3333333e-3F, -1.6666667e-1F, 1.0F};
  const VR sine = hn::Mul(Series(d, hn::Mul(half_angle, half_angle), kTerms), half_angle);
  // Cosine rule without its cancellation: (r - d)^2 + 4 r d sin^2(angle / 2).
  const VR radius = hn::Mul(k, hn::Set(d, known.spacing_mm)), away = hn::Set(d, look.away_mm);
  const VR apart = hn::Sub(radius, away), spread = hn::Mul(hn::Mul(hn::Set(d, 4.0F), radius), away);
  return hn::Add(hn::Mul(apart, apart), hn::Mul(spread, hn::Mul(sine, sine)));
}

/// The discs whose circles are used up.
struct Due {
  static constexpr std::size_t kRoom = kMostDiscs + kPadding;
  HWY_ALIGN std::int32_t disc[kRoom];
  HWY_ALIGN float x[kRoom];
  HWY_ALIGN float y[kRoom];
  HWY_ALIGN float outer[kRoom];
  HWY_ALIGN float away[kRoom];
  HWY_ALIGN float turn[kRoom];
  HWY_ALIGN float radius[kRoom];
};

template <class Slot>
HWY_INLINE std::size_t FindDue(const SectionLine& line, const Known<Slot>& known, int first, int count, Due& due) {
  const D d;
  const DI di;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const V along_0 = hn::Set(d, line.along_0), along_step = hn::Set(d, line.along_step);
  const V tip_x = hn::Set(d, line.tip_x), tip_y = hn::Set(d, line.tip_y);
  const V shaft_x = hn::Set(d, line.shaft_x), shaft_y = hn::Set(d, line.shaft_y);
  const V cone_x = hn::Set(d, line.cone_x), cone_y = hn::Set(d, line.cone_y);
  const V cone_offset = hn::Set(d, line.cone_offset), cone_slope = hn::Set(d, line.cone_slope);
  const V shaft_radius = hn::Set(d, line.shaft_radius), first_along = hn::Set(d, line.first_along);
  const V end = hn::Set(d, static_cast<float>(count));
  std::size_t found = 0;
  for (int n = 0; n < count; n += lanes) {
    const V number = hn::ConvertTo(d, From(n));
    const V along = hn::Sub(along_0, hn::Mul(number, along_step));
    const V cone_radius = hn::Add(cone_offset, hn::Mul(cone_slope, along));
    const auto in_cone = hn::Lt(cone_radius, shaft_radius);
    const V x = hn::Sub(tip_x, hn::Mul(along, hn::IfThenElse(in_cone, cone_x, shaft_x)));
    const V y = hn::Sub(tip_y, hn::Mul(along, hn::IfThenElse(in_cone, cone_y, shaft_y)));
    const V outer = hn::Min(cone_radius, shaft_radius);
    const V from_x = hn::Sub(x, hn::LoadU(d, known.x_mm + first + n));
    const V from_y = hn::Sub(y, hn::LoadU(d, known.y_mm + first + n));
    const V squared = hn::Add(hn::Mul(from_x, from_x), hn::Mul(from_y, from_y));
    const V room = hn::Sub(hn::LoadU(d, known.radius_mm + first + n), outer);
    const auto out = hn::Or(hn::Le(room, hn::Zero(d)), hn::Ge(squared, hn::Mul(room, room)));
    const auto is_due = hn::And(out, hn::And(hn::Lt(number, end), hn::Ge(along, first_along)));
    if (hn::AllFalse(d, is_due)) continue;
    hn::CompressStore(x, is_due, d, due.x + found);
    hn::CompressStore(y, is_due, d, due.y + found);
    hn::CompressStore(outer, is_due, d, due.outer + found);
    found += hn::CompressStore(From(first + n), hn::RebindMask(di, is_due), di, due.disc + found);
  }
  for (std::size_t n = 0; n < found; n += hn::Lanes(d)) {
    const V x = hn::Load(d, due.x + n), y = hn::Load(d, due.y + n);
    hn::Store(hn::Sqrt(hn::Add(hn::Mul(x, x), hn::Mul(y, y))), d, due.away + n);
    hn::Store(Turn(x, y), d, due.turn + n);
  }
  return found;
}

template <class Slot>
HWY_INLINE void LookAt(const Known<Slot>& known, int disc, const Look& look, Touched& touched) {
  const DR d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const RingRange range = ringsNear(known, disc, look);
  const VR reach = hn::Set(d, look.outer_mm * look.outer_mm), end = hn::Set(d, static_cast<float>(range.last));
  const int group = 1 + (range.last - range.first) / 64;
  std::uint64_t rings = 0;
  VR beyond = hn::Set(d, range.beyond_mm2);
  for (int ring = range.first; ring <= range.last; ring += lanes) {
    const VR squared = Squared(known, known.gap(disc, ring), look, ring);
    const auto counted = hn::Le(RingsFrom(ring), end), in_reach = hn::Le(squared, reach);
    beyond = hn::IfThenElse(hn::AndNot(in_reach, counted), hn::Min(beyond, squared), beyond);
    std::uint64_t bits = 0;  // little-endian on every target; WebAssembly is, too
    hn::StoreMaskBits(d, hn::And(in_reach, counted), reinterpret_cast<std::uint8_t*>(&bits));
    if (group == 1) {
      rings |= bits << (ring - range.first);
    } else {
      for (; bits != 0; bits &= bits - 1) {
        rings |= std::uint64_t{1} << ((ring - range.first + __builtin_ctzll(bits)) / group);
      }
    }
  }
  touched.disc = disc;
  touched.whole = range.whole, touched.first = range.first;
  touched.group = group, touched.rings = rings;
  touched.beyond_mm2 = hn::GetLane(hn::MinOfLanes(d, beyond));
  touched.turn = look.turn;
}

template <class Slot>
HWY_INLINE int FindTouched(const SectionLine& line, const Known<Slot>& known, int first, int count, Touched* touched) {
  const D d;
  Due due;
  const std::size_t found = FindDue(line, known, first, count, due);
  int cut = 0;
  for (std::size_t n = 0; n < found; ++n) {
    LookAt(known, due.disc[n], {due.outer[n], due.away[n], due.turn[n]}, touched[cut]);
    touched[cut].about = line.about(due.outer[n]);
    due.radius[n] = touched[cut].beyond_mm2;
    cut += touched[cut].rings != 0 || touched[cut].whole >= known.first_ring[due.disc[n]];
  }
  const V margin = hn::Set(d, known.margin_mm);
  for (std::size_t n = 0; n < found; n += hn::Lanes(d)) {
    hn::Store(hn::Sub(hn::Sqrt(hn::Load(d, due.radius + n)), margin), d, due.radius + n);
  }
  // Of every disc: those that are touched get their circles when they are cut.
  for (std::size_t n = 0; n < found; ++n) {
    const int disc = due.disc[n];
    known.x_mm[disc] = due.x[n], known.y_mm[disc] = due.y[n], known.radius_mm[disc] = due.radius[n];
  }
  return cut;
}

int FindTouched8(const SectionLine& line, const Known<std::uint8_t>& known, int first, int count, Touched* touched) {
  return FindTouched(line, known, first, count, touched);
}
int FindTouched16(const SectionLine& line, const Known<std::uint16_t>& known, int first, int count, Touched* touched) {
  return FindTouched(line, known, first, count, touched);
}

using DU = hn::ScalableTag<std::uint32_t>;

/// Returns what each lane adds up.
HWY_INLINE hn::Vec<DU> Row(std::uint32_t count, std::uint32_t first, const std::uint16_t* density, std::uint32_t* to) {
  const DU d;
  const hn::Rebind<std::uint16_t, DU> dh;
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
  const DU d;
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
  return hn::GetLane(hn::SumOfLanes(DU(), Row(count, first, density, to)));
}

// A plain loop, that compilers turn into vectors of each width: WebAssembly has them for doubles, but Highway none.

/// As Turn above, of doubles and without a branch.
HWY_INLINE double TurnOf(double x, double y) {
  const double a = x < 0 ? -x : x, b = y < 0 ? -y : y;
  const double shorter = a < b ? a : b, longer = a < b ? b : a;
  const double t = shorter / (longer > 1e-30 ? longer : 1e-30), q = t * t;
  double series = kArctangent[0];
  for (std::size_t n = 1; n < std::size(kArctangent); ++n) series = series * q + kArctangent[n];
  const double acute = series * t * (0.5 / kPi);
  const double in_quarter = b > a ? 0.25 - acute : acute;
  const double in_half = x < 0 ? 0.5 - in_quarter : in_quarter;
  return y < 0 ? 1.0 - in_half : in_half;
}

void NearestPoints(const point_volume::Lattice& lattice, const ToolFrame& tool, const PlaceArrays& places,
                   std::size_t count, std::uint32_t* HWY_RESTRICT nearest) {
  const double per_mm = 1.0 / lattice.spacing_mm, first = lattice.first_disc;
  const double discs = lattice.discs, rings = lattice.rings;
  const int per_disc = static_cast<int>(lattice.pointsPerDisc());
  const double* HWY_RESTRICT across_x = places.x_mm;
  const double* HWY_RESTRICT across_y = places.y_mm;
  const double* HWY_RESTRICT along = places.z_mm;
  const ToolFrame t = tool;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = t.tip_mm.x + (t.x.x * across_x[i] + t.y.x * across_y[i]) + t.z.x * along[i];
    const double y = t.tip_mm.y + (t.x.y * across_x[i] + t.y.y * across_y[i]) + t.z.y * along[i];
    const double z = t.tip_mm.z + (t.x.z * across_x[i] + t.y.z * across_y[i]) + t.z.z * along[i];
    // Above zero a cast is the floor.
    const double at = z * per_mm - first + 0.5, out = std::sqrt(x * x + y * y) * per_mm + 0.5;
    const int inside = static_cast<int>(at >= 0) & static_cast<int>(at < discs) & static_cast<int>(out < rings);
    const int disc = static_cast<int>(inside != 0 ? at : 0.0), ring = static_cast<int>(inside != 0 ? out : 0.0);
    const int slots = ring == 0 ? 1 : 6 * ring, start = ring == 0 ? 0 : 3 * ring * (ring - 1) + 1;
    const double past = TurnOf(x, y) * slots + 0.5;
    const int whole = static_cast<int>(past), slot = whole < slots ? whole : whole - slots;
    nearest[i] = inside != 0 ? static_cast<std::uint32_t>(disc * per_disc + start + slot) : kNoPoint;
  }
}

}  // namespace spinaltap::drill::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spinaltap::drill {

HWY_EXPORT(FindTouched8);
HWY_EXPORT(FindTouched16);

int findTouched(const SectionLine& line, const Known<std::uint8_t>& known, int first, int count, Touched* touched) {
  return HWY_DYNAMIC_DISPATCH(FindTouched8)(line, known, first, count, touched);
}
int findTouched(const SectionLine& line, const Known<std::uint16_t>& known, int first, int count, Touched* touched) {
  return HWY_DYNAMIC_DISPATCH(FindTouched16)(line, known, first, count, touched);
}

HWY_EXPORT(HandOut);
HWY_EXPORT(HandOutRow);

HandedOut handOut(std::uint64_t bits, std::uint32_t first, const std::uint16_t* density, std::uint32_t* to) {
  return HWY_DYNAMIC_DISPATCH(HandOut)(bits, first, density, to);
}
std::uint32_t handOutRow(std::uint32_t count, std::uint32_t first, const std::uint16_t* density, std::uint32_t* to) {
  return HWY_DYNAMIC_DISPATCH(HandOutRow)(count, first, density, to);
}

HWY_EXPORT(NearestPoints);

void nearestPoints(const point_volume::Lattice& lattice, const ToolFrame& tool, const PlaceArrays& places,
                   std::size_t count, std::uint32_t* nearest) {
  HWY_DYNAMIC_DISPATCH(NearestPoints)(lattice, tool, places, count, nearest);
}

}  // namespace spinaltap::drill
#endif
