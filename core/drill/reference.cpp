// The truth for all other engines: every alive point is put to the predicate, every cycle.
#include "core/drill/cutter.h"

namespace spinaltap::drill {
namespace {

class Reference final : public Engine {
 public:
  Reference(const point_volume::Lattice& lattice, const plan::Bit& bit, Precision precision)
      : tools_(lattice, bit, precision) {}

  using Engine::step;
  [[nodiscard]] std::string_view name() const override { return "reference"; }
  [[nodiscard]] std::size_t bytes() const override { return tools_.bytes(); }

  Removal step(point_volume::PointVolume& volume, const BitPose& pose, RemovedSink removed) override {
    Cutter cutter(tools_, volume, pose, removed);
    for (int disc = 0; disc < volume.lattice.discs; ++disc) cutter.cut(disc, 0, volume.lattice.pointsPerDisc());
    return cutter.finish();
  }

 private:
  Tools tools_;
};

}  // namespace

std::unique_ptr<Engine> makeReference(const point_volume::Lattice& lattice, const plan::Bit& bit, Precision precision) {
  return std::make_unique<Reference>(lattice, bit, precision);
}

}  // namespace spinaltap::drill
