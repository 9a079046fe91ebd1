// The reference's removed set, from a few points: only the discs that the bit can reach, on each disc only the rings
// that its section can reach, on each ring only the slots that it can. The bounds are derived in bounds.h.
#include <algorithm>
#include <cmath>

#include "core/drill/bounds.h"
#include "core/drill/cutter.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;

void cutRing(Cutter& cutter, int disc, int ring, const PolarCircle& section, double spacing_mm) {
  const std::uint32_t start = Lattice::ringStart(ring);
  if (ring == 0) return cutter.cut(disc, 0, 1);
  const SlotRange range = slotsInside(section, ring, spacing_mm);
  const int slots = Lattice::slotsOf(ring), end = range.first + range.count;
  const auto at = [start](int slot) { return start + static_cast<std::uint32_t>(slot); };
  if (end > slots) cutter.cut(disc, at(0), at(end - slots));
  cutter.cut(disc, at(range.first), at(std::min(end, slots)));
}

void cutDisc(Cutter& cutter, const Lattice& lattice, int disc, const PolarCircle& section) {
  const double spacing = lattice.spacing_mm, d = section.distance_mm, radius = section.radius_mm;
  const int outermost = lattice.rings - 1;
  // Rings wholly inside the circle are one run of points.
  const int whole = heldFloor((radius - d) / spacing, outermost);
  if (whole >= 0) cutter.cut(disc, 0, Lattice::ringStart(whole + 1));
  const int first = std::max(whole + 1, heldCeil((d - radius) / spacing, outermost + 1));
  const int last = heldFloor((d + radius) / spacing, outermost);
  for (int ring = first; ring <= last; ++ring) cutRing(cutter, disc, ring, section, spacing);
}

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
  const Lattice& lattice = cutter.volume().lattice;
  for (int disc = first; disc <= last; ++disc) {
    const Circle section = sectionCircle(bit, pose, lattice.discZ_mm(disc));
    if (section.radius_mm >= 0) cutDisc(cutter, lattice, disc, polar(section));
  }
}

std::unique_ptr<Engine> makeBounded(const point_volume::Lattice& lattice, const plan::Bit& bit) {
  return std::make_unique<Bounded>(lattice, bit);
}

}  // namespace spinaltap::drill
