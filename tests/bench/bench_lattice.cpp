// The figures in core/point_volume/README.md: how evenly points are spread, and how unevenly a bit meets them, for each
// way of turning and shifting the rings. Nothing is timed; the same figures every time.
//
//   bench_lattice [--rings N] [STEP_UM]     default: 36 rings, 1 um a cycle
#include <cstdio>
#include <cstdlib>
#include <string>

#include "core/tradeoff/lattice_study.h"

namespace spinaltap::tradeoff {
namespace {

void spread(const Spread& s) { std::printf("  %.3f %.3f %.3f", s.least, s.mean, s.most); }

void evenness(int rings) {
  std::printf(
      "neighbours in spacings (least mean most), and density in balls of 2.5 and 5 spacings "
      "(spread)\n%-18s%19s%19s%19s\n",
      "", "in ring", "across rings", "across discs");
  const point_volume::Lattice lattice{0.1, rings, 20, 0};
  for (const Phase phase : kPhases) {
    std::printf("%-18s", std::string(nameOf(phase)).c_str());
    const Neighbours n = neighboursOf(lattice, phase);
    spread(n.in_ring), spread(n.across_rings), spread(n.across_discs);
    for (const double radius_mm : {0.25, 0.5}) {
      const Share d = densityOf(lattice, phase, radius_mm, 20'000, 1);
      std::printf("  %.3f (%.1f %%)", d.mean, 100 * d.deviation);
    }
    std::printf("\n");
  }
}

void ripple(double step_mm) {
  std::printf(
      "\nripple of removed volume a cycle at %.4f mm a cycle: deviation, and after a pole of 20 cycles, %%\n%-18s",
      step_mm, "");
  const auto motions = usualMotions(step_mm);
  for (const NamedMotion& m : motions) std::printf("%20s", std::string(m.name).c_str());
  std::printf("\n");
  const double each_mm3 = point_volume::pointVolume_mm3(motionLattice());
  for (const Phase phase : kPhases) {
    std::printf("%-18s", std::string(nameOf(phase)).c_str());
    const auto points = positionsOf(motionLattice(), phase);
    for (const NamedMotion& m : motions) {
      std::printf("%12.1f %7.1f", 100 * rippleOf(points, each_mm3, m.bit, m.motion).deviation,
                  100 * rippleOf(points, each_mm3, m.bit, m.motion, 20).deviation);
    }
    std::printf("\n");
  }
}

}  // namespace
}  // namespace spinaltap::tradeoff

int main(int argc, char** argv) {
  int rings = 36;
  double step_um = 1;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--rings" && i + 1 < argc) {
      rings = std::atoi(argv[++i]);
    } else {
      step_um = std::atof(argv[i]);
    }
  }
  if (rings < 7 || rings > 200 || !(step_um > 0 && step_um <= 100)) {
    std::fprintf(stderr, "usage: bench_lattice [--rings 7..200] [STEP_UM, above 0 and up to 100]\n");
    return 2;
  }
  spinaltap::tradeoff::evenness(rings);
  spinaltap::tradeoff::ripple(step_um / 1000);
  return 0;
}
