// The reference's removed set at about the cost of what changes.
//
// The bit's section with a disc lies in a circle (section.h), and what it can remove is the disc's alive points within.
// Two things are remembered, and since points only die, both stay true for good, whatever the bit does:
//  - for each disc a circle that holds no alive point. While the section stays in it, the disc needs no look; one
//    comparison a disc and cycle says so.
//  - for each ring of a disc a gap, a run of slots that holds no alive point. Seen from the section's centre, a ring's
//    nearest slots are those nearest to the centre's direction; if that lies in the gap, the gap's ends bound the
//    distance to everything alive on the ring.
// So a cycle looks at the discs whose circle is used up, on them at the rings whose gap's ends are within reach, and
// walks there from alive point to alive point, away from the centre's direction, as far as the circle reaches.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <vector>

#include "core/base/dmath.h"
#include "core/drill/bounds.h"
#include "core/drill/cutter.h"
#include "core/drill/second_thread.h"
#include "core/drill/section.h"
#include "core/drill/simd_clearance.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;

constexpr double kFar = 1e18;  // squared mm, and finite as a single

// Fewer discs than that are not worth sharing.
constexpr int kLeastShared = 3 * static_cast<int>(kPadding);

// After so many points taken one by one from a ring, the rest of the arc is taken at once.
constexpr int kLongWalk = 3;

double squared(double x) { return x * x; }

template <class Slot>
class Clearance final : public Engine {
 public:
  Clearance(const Lattice& lattice, const plan::Bit& bit, const EngineOptions& options)
      : tools_(lattice, bit, options.precision),
        circles_(3 * padded(lattice.discs), -1.0F),
        first_ring_(static_cast<std::size_t>(lattice.discs), 0),
        gap_low_(padded(lattice.discs * lattice.rings)),
        gap_high_(padded(lattice.discs * lattice.rings), 1),
        half_slot_rad_(padded(lattice.rings)) {
    for (int k = 1; k < lattice.rings; ++k)
      half_slot_rad_[static_cast<std::size_t>(k)] = static_cast<float>(kPi / 6 / k);
    known_.x_mm = circles_.data();
    known_.y_mm = known_.x_mm + padded(lattice.discs);
    known_.radius_mm = known_.y_mm + padded(lattice.discs);
    known_.first_ring = first_ring_.data();
    known_.low = gap_low_.data();
    known_.high = gap_high_.data();
    known_.half_slot_rad = half_slot_rad_.data();
    known_.rings = lattice.rings;
    if (options.threads == 2) second_ = std::make_unique<SecondThread>();
    known_.rings_per_mm = static_cast<float>(1.0 / lattice.spacing_mm);
    known_.spacing_mm = static_cast<float>(lattice.spacing_mm);
  }

  using Engine::step;
  [[nodiscard]] std::string_view name() const override { return "clearance"; }
  [[nodiscard]] std::size_t bytes() const override {
    return tools_.bytes() + (circles_.size() + half_slot_rad_.size()) * sizeof(float) +
           first_ring_.size() * sizeof(std::uint16_t) + 2 * gap_low_.size() * sizeof(Slot);
  }

  Removal step(PointVolume& volume, const BitPose& pose, RemovedSink removed) override {
    const double slack_mm =
        tools_.precision == Precision::Single ? singleError_mm(tools_.shape, sizeOf(volume, pose)) : 0;
    const Sections sections(tools_.shape, pose, volume.lattice, slack_mm);
    known_.margin_mm = static_cast<float>(sections.margin_mm());
    const int first = sections.first(), last = sections.last();
    const auto cut = [&](int from, int to, RemovedSink sink) {
      return cutDiscs(volume, pose, sections, from, to, sink);
    };
    if (!second_ || last - first < kLeastShared) return cut(first, last, removed);
    // Words and vectors overlap between neighbouring discs, so some in the middle wait until both threads are done.
    const int middle = first + (last - first) / 2;
    const int apart = std::max(static_cast<int>(kPadding), 1 + static_cast<int>(64 / volume.lattice.pointsPerDisc()));
    std::atomic_flag busy;
    const auto in_turn = [&](std::span<const std::uint32_t> indices) {
      while (busy.test_and_set(std::memory_order_acquire)) {
      }
      removed(indices);
      busy.clear(std::memory_order_release);
    };
    Removal theirs, ours;
    second_->run([&] { theirs = cut(middle + apart, last, in_turn); }, [&] { ours = cut(first, middle - 1, in_turn); });
    theirs += ours;
    theirs += cut(middle, std::min(last, middle + apart - 1), removed);
    return theirs;
  }

 private:
  struct Disc {
    int disc;
    Section section;
    double away;  ///< of the section's centre from the path
    float turn;   ///< and its direction
  };

  /// Steps discs first .. last.
  Removal cutDiscs(PointVolume& volume, const BitPose& pose, const Sections& sections, int first, int last,
                   RemovedSink removed) {
    Cutter cutter(tools_, volume, pose, removed);
    if (sections.isFlat()) {
      if (tools_.precision == Precision::Double) {
        cutReachable(cutter, tools_.shape, pose, first, last);
      } else {  // the bounds there allow for doubles' rounding alone
        for (int disc = first; disc <= last; ++disc) cutter.cut(disc, 0, volume.lattice.pointsPerDisc());
      }
      return cutter.finish();
    }
    for (; first <= last; first += kMostDiscs) {
      std::array<Touched, kMostDiscs + 1> touched;
      const int count =
          findTouched(sections.line(first), known_, first, std::min(kMostDiscs, last + 1 - first), touched.data());
      for (int i = 0; i < count; ++i) visit(cutter, sections, touched[static_cast<std::size_t>(i)]);
    }
    return cutter.finish();
  }

  /// How far points and tips may be from the path frame's origin.
  static double sizeOf(const PointVolume& volume, const BitPose& pose) {
    const Lattice& lattice = volume.lattice;
    const double end_mm = std::max(std::abs(lattice.discZ_mm(0)), std::abs(lattice.discZ_mm(lattice.discs - 1)));
    return std::max(norm(pose.tip_mm), end_mm + lattice.rings * lattice.spacing_mm);
  }

  static std::size_t padded(int count) { return static_cast<std::size_t>(count) + kPadding; }

  void visit(Cutter& cutter, const Sections& sections, const Touched& touched) {
    const int disc = touched.disc, rings = cutter.volume().lattice.rings;
    const Section section = sections.at(disc, touched.about);
    const Disc at{disc, section, section.away_mm(), touched.turn};
    double nearest = touched.beyond_mm2;
    if (touched.whole >= known_.first_ring[disc]) nearest = std::min(nearest, cutWhole(cutter, at, touched.whole));
    for (std::uint64_t bits = touched.rings; bits != 0; bits &= bits - 1) {
      const int first = touched.first + __builtin_ctzll(bits) * touched.group;
      const int end = std::min(first + touched.group, rings);
      for (int ring = first; ring < end; ++ring) nearest = std::min(nearest, cutRing(cutter, at, ring));
    }
    known_.radius_mm[disc] = static_cast<float>(std::sqrt(nearest) - sections.margin_mm());
  }

  /// Cuts rings up to `whole`, all of whose points are in the outer circle; returns 0 if any of them stays alive.
  double cutWhole(Cutter& cutter, const Disc& at, int whole) {
    const Lattice& lattice = cutter.volume().lattice;
    std::uint16_t& first = known_.first_ring[at.disc];
    const int sure = heldFloor((at.section.inner_mm - at.away) / lattice.spacing_mm, whole);
    const int split = std::max<int>(first, sure + 1);
    cutter.take(at.disc, Lattice::ringStart(first), Lattice::ringStart(split));
    cutter.cut(at.disc, Lattice::ringStart(split), Lattice::ringStart(whole + 1));
    first = static_cast<std::uint16_t>(firstRing(cutter.volume(), at.disc, first));
    return first <= whole ? 0.0 : kFar;
  }

  /// The first ring of a disc that has alive points, from `ring` on; as many as there are rings when there is none.
  static int firstRing(const PointVolume& volume, int disc, int ring) {
    const std::uint32_t per_disc = volume.lattice.pointsPerDisc(), base = static_cast<std::uint32_t>(disc) * per_disc;
    const std::uint32_t at = firstAlive(volume, base + Lattice::ringStart(ring), base + per_disc) - base;
    while (ring < volume.lattice.rings && Lattice::ringStart(ring + 1) <= at) ++ring;
    return ring;
  }

  /// A ring of a disc, its slots counted from the one at or just below the direction of the section's centre.
  struct Ring {
    int ring, slots, below;
    std::uint32_t in_disc, start;  ///< where it begins in its disc, and in the volume

    [[nodiscard]] int slotAt(int offset) const {
      const int slot = below + offset;
      return slot < 0 ? slot + slots : slot >= slots ? slot - slots : slot;
    }
  };

  /// Walks from the centre's direction to both sides, and returns the squared distance of the nearest that stays alive.
  double cutRing(Cutter& cutter, const Disc& at, int number) {
    const std::size_t gap = known_.gap(at.disc, number);
    const int slots = Lattice::slotsOf(number), half = slots / 2;
    const std::uint32_t in_disc = Lattice::ringStart(number);
    const Ring ring{number, slots, std::min(static_cast<int>(at.turn * static_cast<float>(slots)), slots - 1), in_disc,
                    static_cast<std::uint32_t>(at.disc) * cutter.volume().lattice.pointsPerDisc() + in_disc};
    const int up_end = half + 1, down_end = -half;  // between them, every slot of the ring once
    int up = 1, down = 0;
    // In a gap, the walk begins at its ends; else what is sure to go is taken at once.
    const int low = gap_low_[gap], past = ring.below >= low ? ring.below - low : ring.below - low + slots;
    const int between = gap_high_[gap] - low, width = between > 0 ? between : between + slots;
    if (past < width) {
      up = std::min(width - past, up_end), down = std::max(-past, down_end);
    } else if (const Arc sure = sureArc(cutter, at, ring); sure.first <= sure.last) {
      takeSlots(cutter, at, ring, sure.first, sure.last);
      up = std::max(sure.last + 1, up), down = std::min(sure.first - 1, down);
    }
    double nearest = kFar;
    up = walk(cutter, at, ring, up, up_end, nearest);
    down = walk(cutter, at, ring, down, down_end, nearest);
    // A dead ring's gap is all but one slot, and that one lies opposite.
    const bool dead = up == up_end && down == down_end;
    gap_low_[gap] = static_cast<Slot>(ring.slotAt(dead ? half : down));
    gap_high_[gap] = static_cast<Slot>(ring.slotAt(dead ? half : up));
    return nearest;
  }

  /// From one offset towards another, that one excluded; returns the offset of the first point that stays alive, or
  /// `to`.
  int walk(Cutter& cutter, const Disc& at, const Ring& ring, int from, int to, double& nearest) {
    const double outer = squared(at.section.outer_mm);
    const double inner = at.section.inner_mm > 0 ? squared(at.section.inner_mm) : -1.0;
    const int step = to > from ? 1 : -1;
    int first = to, taken = 0;
    for (int offset = from; offset != to; offset += step) {
      const auto slot = static_cast<std::uint32_t>(ring.slotAt(offset));
      if (!cutter.volume().isAlive(ring.start + slot)) continue;
      const double distance = squared(tools_.table.x_mm[ring.in_disc + slot] - at.section.x_mm) +
                              squared(tools_.table.y_mm[ring.in_disc + slot] - at.section.y_mm);
      if (distance <= outer) {
        if (distance <= inner) {
          cutter.takeOne(ring.start + slot);
          if (++taken != kLongWalk) continue;
          const Arc sure = sureArc(cutter, at, ring);
          const int next = offset + step, last = step > 0 ? std::min(sure.last, to - 1) : std::max(sure.first, to + 1);
          if ((last - next) * step < 0) continue;
          takeSlots(cutter, at, ring, std::min(next, last), std::max(next, last));
          offset = last;
          continue;
        }
        if (cutter.cutOne(ring.start + slot, at.disc)) continue;
      }
      nearest = std::min(nearest, distance);
      if (first == to) first = offset;
      if (distance > outer) break;
    }
    return first;
  }

  /// Offsets first .. last of a ring; none when first > last.
  struct Arc {
    int first, last;
  };

  /// What lies in the inner circle for sure; none when too few do to be worth the trouble.
  Arc sureArc(const Cutter& cutter, const Disc& at, const Ring& ring) const {
    const double spacing = cutter.volume().lattice.spacing_mm, radius = ring.ring * spacing;
    // `turn` is of a centre in single precision, and rounded.
    const double away = at.away, inner = std::max(0.0, at.section.inner_mm - 3.0 * known_.margin_mm);
    // Cosine rule: the circle reaches the angle t from the centre's direction where 4 r d sin^2(t / 2) is this. There
    // are 6 / (2 pi) slots to a spacing.
    const double room = squared(inner) - squared(radius - away);
    if (!(room * radius > squared(kLongWalk * spacing) * away)) return {1, 0};
    const double cosine = 1.0 - room / (2 * away * radius);
    const double half_arc = (cosine > -1.0 ? roughArcCos(cosine) : kPi) - 3 * kAngleError_rad;
    // In slots, and where in its slot the direction is: past offset 0.
    const double reach = half_arc * (ring.slots / (2 * kPi)),
                 past = at.turn * static_cast<float>(ring.slots) - ring.below;
    const int half = ring.slots / 2;  // truncation is the floor of what is above -1, plus one
    return {std::max(1 - static_cast<int>(reach - past + 1.0), 1 - half),
            std::min(static_cast<int>(reach + past), half)};
  }

  /// Takes what is alive from one offset up to another.
  static void takeSlots(Cutter& cutter, const Disc& at, const Ring& ring, int first, int last) {
    const int low = ring.slotAt(first), high = ring.slotAt(last);
    const auto take = [&](int begin, int end) {
      cutter.take(at.disc, ring.in_disc + static_cast<std::uint32_t>(begin),
                  ring.in_disc + static_cast<std::uint32_t>(end));
    };
    if (low <= high) {
      take(low, high + 1);
    } else {
      take(low, ring.slots);
      take(0, high + 1);
    }
  }

  /// The first alive point of begin .. end-1, or end.
  static std::uint32_t firstAlive(const PointVolume& volume, std::uint32_t begin, std::uint32_t end) {
    if (begin >= end) return end;
    std::uint64_t bits = volume.alive[begin >> 6] & (~std::uint64_t{0} << (begin & 63));
    for (std::uint32_t word = begin >> 6;;) {
      if (bits != 0) return std::min(end, (word << 6) + static_cast<std::uint32_t>(__builtin_ctzll(bits)));
      if (++word > (end - 1) >> 6) return end;
      bits = volume.alive[word];
    }
  }

  Tools tools_;
  std::vector<float> circles_;
  std::vector<std::uint16_t> first_ring_;
  std::vector<Slot> gap_low_, gap_high_;
  std::vector<float> half_slot_rad_;
  std::unique_ptr<SecondThread> second_;
  Known<Slot> known_{};  ///< views of the vectors above
};

}  // namespace

std::unique_ptr<Engine> makeClearance(const Lattice& lattice, const plan::Bit& bit, const EngineOptions& options) {
  if (Lattice::slotsOf(lattice.rings) < 256) return std::make_unique<Clearance<std::uint8_t>>(lattice, bit, options);
  return std::make_unique<Clearance<std::uint16_t>>(lattice, bit, options);
}

}  // namespace spinaltap::drill
