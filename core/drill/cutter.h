// core/drill/cutter.h - what every engine does to the points it has chosen: test the alive ones, remove those inside.
// Private to core/drill.
#pragma once
#include <algorithm>
#include <cstdint>
#include <memory>

#include "core/base/hash.h"
#include "core/drill/engine.h"
#include "core/drill/predicate.h"
#include "core/point_volume/lattice.h"

namespace spinaltap::drill {

/// The parts of an engine that do not change between cycles. The index buffer is as large as the volume, so that no
/// cycle can outgrow it.
struct Tools {
  Tools(const point_volume::Lattice& lattice, const plan::Bit& bit)
      : shape(shapeOf(bit)),
        table(point_volume::discTable(lattice)),
        indices(new std::uint32_t[static_cast<std::size_t>(lattice.points())]) {}

  BitShape shape;
  point_volume::DiscTable table;
  std::unique_ptr<std::uint32_t[]> indices;
};

/// One cycle's cutting. Ranges must come in ascending order for the indices to ascend.
class Cutter {
 public:
  Cutter(const Tools& tools, point_volume::PointVolume& volume, const BitPose& pose)
      : tools_(tools), volume_(volume), pose_(pose), per_disc_(volume.lattice.pointsPerDisc()) {}

  /// Tests the alive points begin .. end-1 of one disc, counted within the disc. Dead points cost a 64th of a word.
  void cut(int disc, std::uint32_t begin, std::uint32_t end) {
    if (begin >= end) return;
    const std::uint32_t base = static_cast<std::uint32_t>(disc) * per_disc_;
    const double z_mm = volume_.lattice.discZ_mm(disc);
    const std::uint32_t first = base + begin, last = base + end - 1;
    for (std::uint32_t word = first >> 6; word <= last >> 6; ++word) {
      std::uint64_t bits = volume_.alive[word];
      if (word == first >> 6) bits &= ~std::uint64_t{0} << (first & 63);
      if (word == last >> 6) bits &= ~std::uint64_t{0} >> (63 - (last & 63));
      if (bits != 0) volume_.alive[word] &= ~cutWord(word, bits, base, z_mm);
    }
  }

  /// True when the point was alive and is now removed. @pre as cut().
  bool cutOne(std::uint32_t index, int disc) {
    const std::uint32_t base = static_cast<std::uint32_t>(disc) * per_disc_;
    const std::uint64_t bit = std::uint64_t{1} << (index & 63);
    const std::uint64_t gone =
        cutWord(index >> 6, volume_.alive[index >> 6] & bit, base, volume_.lattice.discZ_mm(disc));
    volume_.alive[index >> 6] &= ~gone;
    return gone != 0;
  }

  /// Puts indices that were removed in descending order, since `count` were removed, into ascending order.
  void reverseSince(std::uint64_t count) {
    std::reverse(tools_.indices.get() + count, tools_.indices.get() + removal_.count);
  }

  [[nodiscard]] Removal removal() const {
    Removal removal = removal_;
    removal.indices = {tools_.indices.get(), static_cast<std::size_t>(removal_.count)};
    return removal;
  }

 private:
  /// The bits of `bits` whose points are inside the bit.
  std::uint64_t cutWord(std::uint32_t word, std::uint64_t bits, std::uint32_t base, double z_mm) {
    std::uint64_t gone = 0;
    while (bits != 0) {
      const std::uint64_t lowest = bits & (~bits + 1);
      const std::uint32_t index = (word << 6) + static_cast<std::uint32_t>(__builtin_ctzll(bits));
      bits ^= lowest;
      ++removal_.tested;
      const Vec3 point_mm{tools_.table.x_mm[index - base], tools_.table.y_mm[index - base], z_mm};
      if (!isInside(tools_.shape, pose_.tip_mm, pose_.axis, point_mm)) continue;
      gone |= lowest;
      tools_.indices[removal_.count++] = index;
      removal_.density_sum_mg_cm3 += volume_.density_mg_cm3[index];
      removal_.hash_delta += mix64(index);
    }
    return gone;
  }

  const Tools& tools_;
  point_volume::PointVolume& volume_;
  const BitPose& pose_;
  std::uint32_t per_disc_;
  Removal removal_;
};

[[nodiscard]] std::unique_ptr<Engine> makeReference(const point_volume::Lattice& lattice, const plan::Bit& bit);
[[nodiscard]] std::unique_ptr<Engine> makeReport(const point_volume::Lattice& lattice, const plan::Bit& bit);
[[nodiscard]] std::unique_ptr<Engine> makeBounded(const point_volume::Lattice& lattice, const plan::Bit& bit);

}  // namespace spinaltap::drill
