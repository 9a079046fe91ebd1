// server/jobs/tradeoff_plots.h - the surface trade-off as pictures (SVG text).
#pragma once
#include <array>
#include <string>
#include <vector>

#include "core/tradeoff/contour.h"
#include "core/tradeoff/surface_tradeoff.h"

namespace spinaltap::jobs {

/// The report's three smoothings and a heavy one, which the silhouettes and bars compare.
inline constexpr std::array<double, 4> kReportSmoothings{0.0, 0.5, 30.0, tradeoff::kSwellingSmoothing_mm};

/// One method's outlines in a view, at each of kReportSmoothings.
using Outlines = std::array<std::vector<tradeoff::Polyline>, kReportSmoothings.size()>;

/// A window with outlines in it: of sections, on the CT, or of the whole bone as seen along an axis.
struct View {
  std::string name;
  bool along_axis = false;
  tradeoff::Plane plane;
  double step_mm = 0.25;  ///< of the outlines
  std::string picture;    ///< of the CT, as a data: address; empty along an axis
  double scale_bar_mm = 10;
  std::vector<tradeoff::Polyline> truth;  ///< empty when it is not known
  std::array<Outlines, 3> methods;        ///< by surface::Method
};

/// From above, from the side and from the front; then three sections: across at the pedicles, along in the middle, and
/// close at an articular process.
[[nodiscard]] std::vector<View> viewsOf(const tradeoff::Scene& scene);
/// Adds a run's outlines when it has one of kReportSmoothings and no reduction.
void addOutlines(const tradeoff::Run& run, std::vector<View>& views);

/// Error against seconds; what smoothing does; what reduction costs; silhouettes; sections.
struct Picture {
  std::string file_name, svg;
};
[[nodiscard]] std::vector<Picture> picturesOf(const std::vector<tradeoff::Measured>& rows,
                                              const std::vector<View>& views, bool truth_known);

}  // namespace spinaltap::jobs
