// core/session/contact.h - the bone that the bit would meet, as haptics asks for it: areas weighted with hardness.
#pragma once
#include <array>
#include <cstdint>

#include "core/drill/probe.h"
#include "core/haptics/proxy.h"

namespace spinaltap::session {

/// Private to core/session and its tests.
class Contact {
 public:
  /// @pre both are valid.
  Contact(const point_volume::Lattice& lattice, const plan::Bit& bit);

  /// Does not allocate. @pre as drill::Probe::look.
  [[nodiscard]] haptics::Meeting meet(const point_volume::PointVolume& volume, const drill::BitPose& pose) const;

  /// Meeting::frontal_mm2 alone, for half the cost.
  [[nodiscard]] double frontal_mm2(const point_volume::PointVolume& volume, const drill::BitPose& pose) const;

  /// True where a bit that does not turn can't be: an alive point is inside.
  [[nodiscard]] bool isBlocked(const point_volume::PointVolume& volume, const drill::BitPose& pose) const;

  /// How far the bit can move from a pose in one step, so that what was met is still what is there: a spacing, or as
  /// far as it is from the lattice.
  [[nodiscard]] double longestStep_mm(const drill::BitPose& pose) const;

 private:
  // The sides' facets meet as eight directions of four stretches of the bit: the tip, and thirds of the shaft.
  static constexpr std::size_t kDirections = 8, kStretches = 4;
  static_assert(kDirections * kStretches == haptics::kMostSides);

  double spacing_mm_;
  drill::BitShape shape_;
  drill::Probe probe_;
  std::array<std::uint8_t, drill::Probe::kTipFacets>
      eighth_{};  ///< that a facet looks into; the tip's, then the shaft's
};

}  // namespace spinaltap::session
