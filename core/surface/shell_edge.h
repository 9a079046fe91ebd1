// core/surface/shell_edge.h - where bone ends on one profile of the CT (internal to surface).
// After: Treece, Gee, Mayhew, Poole, "High resolution cortical bone thickness measurement from clinical CT data",
// Medical Image Analysis 14 (2010): a cortex of known density, as blurred as the scan is, is fitted to the profile.
// Half-way between the profile's peak and what lies outside is right only for a cortex thicker than the blur; a thin
// one is drawn outwards by it (measured on the phantom: 0.10 mm RMS across slices, 0.28 mm with a cortex of 0.5 mm).
#pragma once
#include <optional>
#include <span>

namespace spinaltap::surface {

/// HU at first_mm, first_mm + step_mm, ... along the outward normal.
struct Profile {
  std::span<const double> hu;
  double first_mm = 0, step_mm = 0.1;
  [[nodiscard]] double at_mm(std::size_t n) const { return first_mm + step_mm * static_cast<double>(n); }
};

/// What is known before the profile is looked at.
struct EdgeQuery {
  double reach_mm = 1;              ///< the edge is sought so far either side of 0
  double blur_mm = 0.3;             ///< standard deviation of the point spread along the profile
  bool free_blur = false;           ///< blur_mm is only where to begin: it is fitted too
  double cortical_hu = 0;           ///< of solid cortex, unblurred
  double cortical_spread_hu = 150;  ///< how far off that may be
  double most_inside_mm = 1e9;      ///< farther inwards the profile is not looked at
  double least_fall_hu = 0;         ///< a weaker edge is none
};

struct ShellEdge {
  double edge_mm = 0;  ///< where the cortex ends, outside
  double half_mm = 0;  ///< half-way from the peak to what is outside, for comparison
  double thickness_mm = 0;
  double outside_hu = 0, inside_hu = 0, cortical_hu = 0, peak_hu = 0;
  double blur_mm = 0;
  double misfit_hu = 0;  ///< RMS
};

/// Empty when the profile does not fall by least_fall_hu within the reach.
/// @pre the profile covers the reach and at least plateauOf(query) beyond it on either side.
[[nodiscard]] std::optional<ShellEdge> findShellEdge(const Profile& profile, const EdgeQuery& query);

/// How far beyond the edge a profile is looked at: the cortex, the marrow behind it, the tissue before it.
[[nodiscard]] double plateauOf(const EdgeQuery& query);

}  // namespace spinaltap::surface
