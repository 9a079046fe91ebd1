// The 2002 algorithm, as we read it: R. Schmidt, "SpinalTap: An Architecture For Real-Time Vertebrae Drilling
// Simulation", sections 6.2 and 7. It is the rival in benchmarks, not an engine to drill with.
//
// What it does. The volume is a cylinder of discs of rings of points. The tip passes each slice first, so only discs
// that the cone passes are tested; the first disc behind the cone is included, or a motion of less than a spacing could
// leave a disc before its outermost ring goes. Inner rings go before outer ones, so each disc remembers its innermost
// ring that still has points. A ring is tried when its radius lies within the section's reach, taken as the cone's
// radius where the axis meets the disc, stretched by the tilt. A convex section meets a ring at most twice, so the
// points to remove are one arc: the walk around a ring ends when it leaves the arc.
//
// Where it leaves bone standing (design, section 7):
//  - whatever the shaft alone touches: a bit that moves or tilts sideways, a first pose inside the bone, a step along
//    the path that is longer than a spacing;
//  - the second arc of a ring that a tilted bit's ellipse cuts twice;
//  - parts of a tilted cone's section beyond the stretched circle.
// It never removes a point that the reference would not: each one is put to the same predicate.
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/drill/cutter.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;

class Report final : public Engine {
 public:
  Report(const Lattice& lattice, const plan::Bit& bit)
      : tools_(lattice, bit), innermost_(static_cast<std::size_t>(lattice.discs), 0) {}

  using Engine::step;
  [[nodiscard]] std::string_view name() const override { return "report"; }
  [[nodiscard]] std::size_t bytes() const override { return tools_.bytes() + innermost_.size() * sizeof(int); }

  Removal step(point_volume::PointVolume& volume, const BitPose& pose, RemovedSink removed) override {
    const Lattice& lattice = volume.lattice;
    Cutter cutter(tools_, volume, pose, removed);
    const double tip = pose.tip_mm.z / lattice.spacing_mm - static_cast<double>(lattice.first_disc);
    const double base = tip - tools_.shape.cone_mm * pose.axis.z / lattice.spacing_mm;
    const int first = static_cast<int>(std::floor(held(std::min(tip, base), lattice.discs)));
    const int last = static_cast<int>(std::ceil(held(std::max(tip, base), lattice.discs)));
    for (int disc = std::max(first, 0); disc <= std::min(last, lattice.discs - 1); ++disc) {
      cutDisc(cutter, volume, pose, disc);
    }
    return cutter.finish();
  }

 private:
  static double held(double disc, int discs) { return std::min(std::max(disc, -1.0), static_cast<double>(discs)); }

  void cutDisc(Cutter& cutter, const point_volume::PointVolume& volume, const BitPose& pose, int disc) {
    const Lattice& lattice = volume.lattice;
    const double upright = std::max(std::abs(pose.axis.z), 0.05);
    const double rise_mm = pose.tip_mm.z - lattice.discZ_mm(disc);
    const double along = pose.axis.z < 0 ? -rise_mm / upright : rise_mm / upright;
    const double x = pose.tip_mm.x - along * pose.axis.x, y = pose.tip_mm.y - along * pose.axis.y;
    const double cone_part =
        tools_.shape.cone_mm > 0 ? std::min(std::max(along / tools_.shape.cone_mm, 0.0), 1.0) : 1.0;
    const double reach = cone_part * tools_.shape.radius_mm / upright / lattice.spacing_mm;
    const double centre = std::sqrt(x * x + y * y) / lattice.spacing_mm;
    int& innermost = innermost_[static_cast<std::size_t>(disc)];
    while (innermost < lattice.rings && isEmpty(volume, disc, innermost)) ++innermost;
    for (int ring = innermost; ring < lattice.rings; ++ring) {
      const double away = std::abs(static_cast<double>(ring) - centre);
      if (away > reach + 1.0) {  // a ring of slack, for rounding
        if (static_cast<double>(ring) > centre) break;
        continue;
      }
      cutArc(cutter, volume, disc, ring);
    }
  }

  static std::uint32_t indexOf(const Lattice& lattice, int disc, int ring, int slot) {
    return lattice.index({disc, ring, slot});
  }

  static bool isEmpty(const point_volume::PointVolume& volume, int disc, int ring) {
    for (int slot = 0; slot < Lattice::slotsOf(ring); ++slot) {
      if (volume.isAlive(indexOf(volume.lattice, disc, ring, slot))) return false;
    }
    return true;
  }

  /// Forward to the arc's first point and along it to its end; an arc that holds slot 0 goes on backwards from there.
  static void cutArc(Cutter& cutter, const point_volume::PointVolume& volume, int disc, int ring) {
    const int slots = Lattice::slotsOf(ring);
    bool in_arc = false, from_start = true;
    int slot = 0;
    for (; slot < slots; ++slot) {
      const std::uint32_t index = indexOf(volume.lattice, disc, ring, slot);
      if (!volume.isAlive(index)) continue;
      if (cutter.cutOne(index, disc)) {
        in_arc = true;
      } else if (in_arc) {
        break;
      } else {
        from_start = false;
      }
    }
    if (!in_arc || !from_start) return;
    for (int back = slots - 1; back > slot; --back) {
      const std::uint32_t index = indexOf(volume.lattice, disc, ring, back);
      if (volume.isAlive(index) && !cutter.cutOne(index, disc)) break;
    }
  }

  Tools tools_;
  std::vector<int> innermost_;  ///< of each disc
};

}  // namespace

std::unique_ptr<Engine> makeReport(const point_volume::Lattice& lattice, const plan::Bit& bit) {
  return std::make_unique<Report>(lattice, bit);
}

}  // namespace spinaltap::drill
