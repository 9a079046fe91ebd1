// server/plots/chart.h - axes, and points and bars in them.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "server/plots/svg.h"

namespace spinaltap::plots {

struct Axis {
  std::string title;  ///< with its unit
  double low = 0, high = 1;
  bool logarithmic = false;             ///< then low > 0
  std::vector<double> ticks = {};       ///< where they stand; empty: at round places
  std::vector<std::string> names = {};  ///< one a tick; empty: their numbers
};

/// An axis that holds these values, with a little room; logarithmic when asked and all are positive. Bars want zero.
[[nodiscard]] Axis axisFor(std::string title, const std::vector<double>& values, bool logarithmic, bool from_zero);

/// The axis's own ticks, or round places from low to high: 1, 2 or 5 times a power of ten.
[[nodiscard]] std::vector<double> ticksOf(const Axis& axis);

struct Series {
  std::string name;
  std::string_view colour;
  std::vector<Place> points;        ///< in the axes' units
  std::vector<std::string> labels;  ///< one a point, or none
  bool joined = false;              ///< by a line, in the order given
  std::string_view dash = {};       ///< of that line, as stroke-dasharray; empty: none
  bool dots = true;                 ///< at the points
};

/// One panel of a page: where it lies, what it is about.
struct Panel {
  Place corner;  ///< of the area inside the axes, px
  double width = 320, height = 240;
  std::string title;
};

void drawPoints(Svg& svg, const Panel& panel, const Axis& x, const Axis& y, const std::vector<Series>& series);

/// A dotted line across at a value of the y axis, with its name above it, or below where there is no room above.
/// @pre the value lies on the axis.
void drawLevel(Svg& svg, const Panel& panel, const Axis& y, double value, const std::string& name);

/// groups[g].values[s] is the bar of series s in group g; NaN leaves it out, with a cross in its place.
struct BarGroup {
  std::string name;
  std::vector<double> values;
};
void drawBars(Svg& svg, const Panel& panel, const Axis& y, const std::vector<BarGroup>& groups,
              const std::vector<std::string_view>& colours);

/// Names with dots of their colours, in a row from `at` on.
void drawLegend(Svg& svg, const Place& at, const std::vector<std::string>& names,
                const std::vector<std::string_view>& colours);

}  // namespace spinaltap::plots
