// The reference's removed set, from a few points: only the discs that the bit can reach, on each disc only the rings
// that its section can reach, on each ring only the slots that it can. The bounds are derived in bounds.h.
#include "core/drill/cutter.h"
#include "core/drill/probe.h"
#include "core/drill/reachable.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;

class Bounded final : public Engine {
 public:
  Bounded(const Lattice& lattice, const plan::Bit& bit) : tools_(lattice, bit) {}

  using Engine::step;
  [[nodiscard]] std::string_view name() const override { return "bounded"; }
  [[nodiscard]] std::size_t bytes() const override { return tools_.bytes(); }

  Removal step(point_volume::PointVolume& volume, const BitPose& pose, RemovedSink removed) override {
    Cutter cutter(tools_, volume, pose, removed);
    const DiscRange reached = discsWithin(reachAlongPath(tools_.shape, pose), volume.lattice);
    cutReachable(cutter, tools_.shape, pose, reached.first, reached.last);
    return cutter.finish();
  }

 private:
  Tools tools_;
};

}  // namespace

void cutReachable(Cutter& cutter, const BitShape& bit, const BitPose& pose, int first, int last) {
  anyReachable(cutter.volume().lattice, bit, pose, {first, last},
               [&](int disc, std::uint32_t begin, std::uint32_t end) {
                 cutter.cut(disc, begin, end);
                 return false;
               });
}

bool meetsAlive(const point_volume::PointVolume& volume, const BitShape& bit, const BitPose& pose) {
  const Lattice& lattice = volume.lattice;
  const DiscRange reached = discsWithin(reachAlongPath(bit, pose), lattice);
  return anyReachable(lattice, bit, pose, reached, [&](int disc, std::uint32_t begin, std::uint32_t end) {
    const std::uint32_t base = static_cast<std::uint32_t>(disc) * lattice.pointsPerDisc();
    for (std::uint32_t index = base + begin; index < base + end; ++index) {
      if ((volume.alive[index >> 6] >> (index & 63)) == 0) {
        index |= 63;  // nothing more in this word
      } else if (volume.isAlive(index) &&
                 isInside(bit, pose.tip_mm, pose.axis, point_volume::positionOf(lattice, index))) {
        return true;
      }
    }
    return false;
  });
}

std::unique_ptr<Engine> makeBounded(const point_volume::Lattice& lattice, const plan::Bit& bit) {
  return std::make_unique<Bounded>(lattice, bit);
}

}  // namespace spinaltap::drill
