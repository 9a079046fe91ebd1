// The truth for all other engines: every alive point is put to the predicate, every cycle.
#include "core/drill/cutter.h"

namespace spinaltap::drill {
namespace {

class Reference final : public Engine {
 public:
  Reference(const point_volume::Lattice& lattice, const plan::Bit& bit) : tools_(lattice, bit) {}

  [[nodiscard]] std::string_view name() const override { return "reference"; }

  Removal step(point_volume::PointVolume& volume, const BitPose& pose) override {
    Cutter cutter(tools_, volume, pose);
    for (int disc = 0; disc < volume.lattice.discs; ++disc) cutter.cut(disc, 0, volume.lattice.pointsPerDisc());
    return cutter.removal();
  }

 private:
  Tools tools_;
};

}  // namespace

std::unique_ptr<Engine> makeReference(const point_volume::Lattice& lattice, const plan::Bit& bit) {
  return std::make_unique<Reference>(lattice, bit);
}

}  // namespace spinaltap::drill
