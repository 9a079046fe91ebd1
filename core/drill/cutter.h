// core/drill/cutter.h - what every engine does to the points it has chosen: test the alive ones, remove those inside.
// Private to core/drill.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>

#include "core/drill/engine.h"
#include "core/drill/predicate.h"
#include "core/drill/simd_hand_out.h"
#include "core/point_volume/lattice.h"

namespace spinaltap::drill {

/// The parts of an engine that do not change between cycles.
struct Tools {
  Tools(const point_volume::Lattice& lattice, const plan::Bit& bit, Precision precision_ = Precision::Double)
      : precision(precision_), shape(shapeOf(bit)), table(point_volume::discTable(lattice)) {}
  [[nodiscard]] std::size_t bytes() const { return 2 * table.x_mm.size() * sizeof(double); }

  Precision precision;
  BitShape shape;
  point_volume::DiscTable table;
};

/// One cycle's cutting.
class Cutter {
 public:
  Cutter(const Tools& tools, point_volume::PointVolume& volume, const BitPose& pose, RemovedSink sink)
      : tools_(tools), volume_(volume), pose_(pose), sink_(sink), per_disc_(volume.lattice.pointsPerDisc()) {}

  /// Tests the alive points begin .. end-1 of one disc, counted within the disc. Dead points cost a 64th of a word.
  void cut(int disc, std::uint32_t begin, std::uint32_t end) {
    const double z_mm = volume_.lattice.discZ_mm(disc);
    const std::uint32_t base = static_cast<std::uint32_t>(disc) * per_disc_;
    forWords(base + begin, base + end,
             [&](std::uint32_t word, std::uint64_t bits) { remove(word, insideOf(word, bits, base, z_mm)); });
  }

  /// Removes the alive ones of such points without a test. @pre the predicate would put them all inside.
  void take(int disc, std::uint32_t begin, std::uint32_t end) {
    const std::uint32_t base = static_cast<std::uint32_t>(disc) * per_disc_;
    std::uint32_t first = base + begin, next = first;  // points that are gone, and not yet handed out
    forWords(base + begin, base + end, [&](std::uint32_t word, std::uint64_t bits) {
      const auto low = (word << 6) + static_cast<std::uint32_t>(__builtin_ctzll(bits));
      const std::uint64_t row = bits >> (low & 63);
      if ((row & (row + 1)) != 0) return remove(word, bits);
      kill(word, bits);
      if (low != next) handOutRow(first, next), first = low;
      next = (word << 6) + 64 - static_cast<std::uint32_t>(__builtin_clzll(bits));
    });
    handOutRow(first, next);
  }

  /// True when the point was alive and is now removed. @pre as cut().
  bool cutOne(std::uint32_t index, int disc) {
    const std::uint64_t bits = volume_.alive[index >> 6] & (std::uint64_t{1} << (index & 63));
    if (insideOf(index >> 6, bits, static_cast<std::uint32_t>(disc) * per_disc_, volume_.lattice.discZ_mm(disc)) == 0) {
      return false;
    }
    takeOne(index);
    return true;
  }

  /// Removes a point without a test. @pre it is alive, and the predicate would put it inside.
  void takeOne(std::uint32_t index) {
    kill(index >> 6, std::uint64_t{1} << (index & 63));
    makeRoom(1);
    indices_[held_++] = index;
    ++removal_.count;
    removal_.density_sum_mg_cm3 += volume_.density_mg_cm3[index];
  }

  [[nodiscard]] Removal finish() {
    flush();
    return removal_;
  }
  [[nodiscard]] const point_volume::PointVolume& volume() const { return volume_; }

 private:
  /// each(word, alive bits of it) for the words that hold first .. end-1 and have any.
  template <class Each>
  void forWords(std::uint32_t first, std::uint32_t end, const Each& each) {
    if (first >= end) return;
    const std::uint32_t last = end - 1;
    for (std::uint32_t word = first >> 6; word <= last >> 6; ++word) {
      std::uint64_t bits = volume_.alive[word];
      if (word == first >> 6) bits &= ~std::uint64_t{0} << (first & 63);
      if (word == last >> 6) bits &= ~std::uint64_t{0} >> (63 - (last & 63));
      if (bits != 0) each(word, bits);
    }
  }

  /// The bits of `bits` whose points are inside the bit.
  std::uint64_t insideOf(std::uint32_t word, std::uint64_t bits, std::uint32_t base, double z_mm) {
    return tools_.precision == Precision::Double ? insideBy<double>(word, bits, base, z_mm)
                                                 : insideBy<float>(word, bits, base, z_mm);
  }

  template <class T>
  std::uint64_t insideBy(std::uint32_t word, std::uint64_t bits, std::uint32_t base, double z_mm) {
    std::uint64_t inside = 0;
    for (; bits != 0; bits &= bits - 1) {
      const std::uint32_t index = (word << 6) + static_cast<std::uint32_t>(__builtin_ctzll(bits));
      ++removal_.tested;
      const Vec3 point_mm{tools_.table.x_mm[index - base], tools_.table.y_mm[index - base], z_mm};
      if (isInside<T>(tools_.shape, pose_.tip_mm, pose_.axis, point_mm)) inside |= bits & (~bits + 1);
    }
    return inside;
  }

  /// @pre the points of `gone` are alive.
  void remove(std::uint32_t word, std::uint64_t gone) {
    if (gone == 0) return;
    if (word + 2 >= volume_.alive.size()) {  // densities end with the last point
      for (; gone != 0; gone &= gone - 1) takeOne((word << 6) + static_cast<std::uint32_t>(__builtin_ctzll(gone)));
      return;
    }
    kill(word, gone);
    makeRoom(128);
    const HandedOut out =
        handOut(gone, word << 6, volume_.density_mg_cm3.data() + (word << 6), indices_.data() + held_);
    held_ += out.count;
    removal_.count += out.count;
    removal_.density_sum_mg_cm3 += out.density_sum;
  }

  void handOutRow(std::uint32_t first, std::uint32_t end) {
    while (first < end) {
      makeRoom(indices_.size() / 2);
      const auto room = static_cast<std::uint32_t>(indices_.size() / 2 - 64);
      const std::uint32_t count = std::min(end - first, room);
      const bool at_end = first + count + 64 > volume_.density_mg_cm3.size();
      const std::uint16_t* density = volume_.density_mg_cm3.data() + first;
      std::uint32_t* to = indices_.data() + held_;
      if (at_end) {
        for (std::uint32_t i = 0; i < count; ++i) to[i] = first + i, removal_.density_sum_mg_cm3 += density[i];
      } else {
        removal_.density_sum_mg_cm3 += drill::handOutRow(count, first, density, to);
      }
      held_ += count, removal_.count += count, first += count;
    }
  }

  void kill(std::uint32_t word, std::uint64_t gone) {
    std::uint64_t& alive = volume_.alive[word];
    removal_.hash_delta -= point_volume::wordHash(word, alive);
    alive &= ~gone;
    removal_.hash_delta += point_volume::wordHash(word, alive);
  }

  void makeRoom(std::size_t count) {
    if (held_ + count > indices_.size()) flush();
  }

  void flush() {
    if (held_ != 0) sink_({indices_.data(), held_});
    held_ = 0;
  }

  const Tools& tools_;
  point_volume::PointVolume& volume_;
  const BitPose& pose_;
  RemovedSink sink_;
  std::uint32_t per_disc_;
  Removal removal_;
  std::uint32_t held_ = 0;
  std::array<std::uint32_t, 512> indices_;
};

/// Cuts what the bit can reach on discs first .. last, whatever its pose (bounds.h). In double precision.
void cutReachable(Cutter& cutter, const BitShape& bit, const BitPose& pose, int first, int last);

[[nodiscard]] std::unique_ptr<Engine> makeReference(const point_volume::Lattice& lattice, const plan::Bit& bit,
                                                    Precision precision);
[[nodiscard]] std::unique_ptr<Engine> makeReport(const point_volume::Lattice& lattice, const plan::Bit& bit);
[[nodiscard]] std::unique_ptr<Engine> makeBounded(const point_volume::Lattice& lattice, const plan::Bit& bit);
[[nodiscard]] std::unique_ptr<Engine> makeClearance(const point_volume::Lattice& lattice, const plan::Bit& bit,
                                                    const EngineOptions& options);

}  // namespace spinaltap::drill
