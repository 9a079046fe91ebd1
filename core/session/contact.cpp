#include "core/session/contact.h"

#include <algorithm>
#include <cmath>

namespace spinaltap::session {
namespace {

/// Which eighth of a turn (x, y) lies in.
std::size_t eighthOf(double x, double y) {
  const bool steep = std::abs(y) > std::abs(x);
  const std::size_t quarter = y >= 0 ? (x >= 0 ? 0 : 1) : (x < 0 ? 2 : 3);
  return 2 * quarter + (quarter % 2 == 0 ? steep : !steep);
}

/// 0 for the tip's facets, 1 to 3 for those of the shaft's thirds from the cone backward.
std::size_t stretchOf(std::size_t i) {
  constexpr std::size_t kTip = drill::Probe::kTipFacets, kShaft = drill::Probe::kShaftFacets;
  return i < kTip ? 0 : 1 + 3 * (2 * (i - kTip) + 1) / (2 * kShaft);
}

}  // namespace

Contact::Contact(const point_volume::Lattice& lattice, const plan::Bit& bit)
    : spacing_mm_(lattice.spacing_mm), shape_(drill::shapeOf(bit)), probe_(lattice, bit) {
  for (std::size_t i = 0; i < eighth_.size(); ++i) {
    const drill::Facet facet = probe_.facet(i);
    eighth_[i] = static_cast<std::uint8_t>(eighthOf(facet.out_x, facet.out_y));
  }
}

haptics::Meeting Contact::meet(const point_volume::PointVolume& volume, const drill::BitPose& pose) const {
  haptics::Meeting meeting;
  if (probe_.clearOfLattice_mm(pose) > 0) return meeting;
  std::array<std::uint16_t, drill::Probe::kMostFacets> densities;
  probe_.look(volume, pose, haptics::toolX(pose.axis), haptics::toolY(pose.axis), densities);
  struct Sum {
    double x = 0, y = 0, behind = 0, area = 0;
  };
  std::array<Sum, haptics::kMostSides> sums{};
  for (std::size_t i = 0; i < probe_.count(); ++i) {
    if (densities[i] == 0) continue;
    const drill::Facet facet = probe_.facet(i);
    const double hardness = haptics::hardness(densities[i]);
    const drill::FacetArea& whole = probe_.areaOf(i);
    meeting.frontal_mm2 += hardness * whole.frontal_mm2;
    const double area = hardness * whole.side_mm2;
    if (i >= drill::Probe::kTipFacets) meeting.rubbing_mm2 += area;
    Sum& sum = sums[stretchOf(i) * kDirections + eighth_[i % drill::Probe::kTipFacets]];
    sum.x += area * facet.out_x, sum.y += area * facet.out_y;
    sum.behind -= area * facet.z_mm, sum.area += area;
  }
  for (const Sum& sum : sums) {
    const double across = std::sqrt(sum.x * sum.x + sum.y * sum.y);
    if (!(across > 0)) continue;
    const double lever = std::min(1.0, std::max(0.0, sum.behind / (sum.area * haptics::kGrip_mm)));
    meeting.sides[meeting.side_count++] = {sum.x / across, sum.y / across, lever, across};
  }
  return meeting;
}

double Contact::frontal_mm2(const point_volume::PointVolume& volume, const drill::BitPose& pose) const {
  std::array<std::uint16_t, drill::Probe::kTipFacets> densities;
  probe_.look(volume, pose, haptics::toolX(pose.axis), haptics::toolY(pose.axis), densities);
  double sum = 0;
  for (const std::uint16_t density : densities) sum += haptics::hardness(density) * probe_.areaOf(0).frontal_mm2;
  return sum;
}

bool Contact::isBlocked(const point_volume::PointVolume& volume, const drill::BitPose& pose) const {
  return probe_.clearOfLattice_mm(pose) == 0 && drill::meetsAlive(volume, shape_, pose);
}

double Contact::longestStep_mm(const drill::BitPose& pose) const {
  return std::max(spacing_mm_, probe_.clearOfLattice_mm(pose));
}

}  // namespace spinaltap::session
