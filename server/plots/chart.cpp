#include "server/plots/chart.h"

#include <algorithm>
#include <cmath>

namespace spinaltap::plots {
namespace {

constexpr Stroke kGrid{"#e4e4e4", 1, ""}, kFrame{"#888", 1, ""}, kLevel{"#555", 1.5, "2 4"};
constexpr double kLetter = 6.2;  // px, a letter of 11 px text

double share(const Axis& axis, double value) {
  if (axis.logarithmic) return std::log(value / axis.low) / std::log(axis.high / axis.low);
  return (value - axis.low) / (axis.high - axis.low);
}

double xOf(const Panel& p, const Axis& axis, double value) { return p.corner[0] + p.width * share(axis, value); }
double yOf(const Panel& p, const Axis& axis, double value) { return p.corner[1] + p.height * (1 - share(axis, value)); }

void drawY(Svg& svg, const Panel& p, const Axis& y) {
  for (const double tick : ticksOf(y)) {
    const double at = yOf(p, y, tick);
    svg.line({p.corner[0], at}, {p.corner[0] + p.width, at}, kGrid);
    svg.text({p.corner[0] - 6, at + 4}, shortNumber(tick), {11, Anchor::End});
  }
  svg.text({p.corner[0] - 44, p.corner[1] + p.height / 2}, y.title, {12, Anchor::Middle, "#222", false, true});
  svg.text({p.corner[0], p.corner[1] - 10}, p.title, {13, Anchor::Start, "#111", true});
}

void drawX(Svg& svg, const Panel& p, const Axis& x) {
  const std::vector<double> ticks = ticksOf(x);
  for (std::size_t n = 0; n < ticks.size(); ++n) {
    const double at = xOf(p, x, ticks[n]);
    svg.line({at, p.corner[1]}, {at, p.corner[1] + p.height}, kGrid);
    svg.text({at, p.corner[1] + p.height + 16}, n < x.names.size() ? x.names[n] : shortNumber(ticks[n]),
             {11, Anchor::Middle});
  }
  svg.text({p.corner[0] + p.width / 2, p.corner[1] + p.height + 36}, x.title, {12, Anchor::Middle});
}

/// Labels beside their points, each moved down until it covers none drawn before.
class Labels {
 public:
  explicit Labels(const Panel& panel) : panel_(panel) {}
  void draw(Svg& svg, const Place& point, const std::string& text, std::string_view colour) {
    const double width = kLetter * static_cast<double>(text.size());
    const bool left = point[0] + 8 + width > panel_.corner[0] + panel_.width;
    Place at{left ? point[0] - 8 - width : point[0] + 8, point[1] + 4};
    const auto covered = [&](const Place& other, double other_width) {
      return std::abs(other[1] - at[1]) < 11 && at[0] < other[0] + other_width && other[0] < at[0] + width;
    };
    for (bool moved = true; moved;) {
      moved = false;
      for (const auto& [other, other_width] : drawn_) {
        if (covered(other, other_width)) at[1] = other[1] + 11.5, moved = true;
      }
    }
    drawn_.emplace_back(at, width);
    svg.text(at, text, {11, Anchor::Start, colour});
  }

 private:
  const Panel& panel_;
  std::vector<std::pair<Place, double>> drawn_;
};

}  // namespace

Axis axisFor(std::string title, const std::vector<double>& values, bool logarithmic, bool from_zero) {
  Axis axis{std::move(title), 0, 1, false, {}, {}};
  std::vector<double> finite;
  std::copy_if(values.begin(), values.end(), std::back_inserter(finite), [](double v) { return std::isfinite(v); });
  if (finite.empty()) return axis;
  const auto [low, high] = std::minmax_element(finite.begin(), finite.end());
  axis.logarithmic = logarithmic && *low > 0;
  if (axis.logarithmic) {
    axis.low = *low / 1.4, axis.high = *high * 1.4;
    return axis;
  }
  axis.low = from_zero ? std::min(*low, 0.0) : *low;
  axis.high = from_zero ? std::max(*high, 0.0) : *high;
  const double room = axis.high > axis.low ? 0.08 * (axis.high - axis.low) : 0.5;
  if (!from_zero || axis.low < 0) axis.low -= room;
  if (!from_zero || axis.high > 0) axis.high += room;
  if (!(axis.high > axis.low)) axis.high = axis.low + 1;
  return axis;
}

std::vector<double> ticksOf(const Axis& axis) {
  if (!axis.ticks.empty()) return axis.ticks;
  std::vector<double> out;
  if (axis.logarithmic) {
    const bool many = axis.high / axis.low > 300;
    for (double decade = std::pow(10, std::floor(std::log10(axis.low))); decade <= axis.high; decade *= 10) {
      for (const double step : {1.0, 2.0, 5.0}) {
        if (many && step > 1) continue;
        if (decade * step >= axis.low && decade * step <= axis.high) out.push_back(decade * step);
      }
    }
    return out;
  }
  const double rough = (axis.high - axis.low) / 5, decade = std::pow(10, std::floor(std::log10(rough)));
  const double step = decade * (rough > 5 * decade ? 10 : rough > 2 * decade ? 5 : rough > decade ? 2 : 1);
  for (double n = std::ceil(axis.low / step); n * step <= axis.high * (1 + 1e-12); ++n) out.push_back(n * step);
  return out;
}

void drawPoints(Svg& svg, const Panel& panel, const Axis& x, const Axis& y, const std::vector<Series>& series) {
  drawX(svg, panel, x);
  drawY(svg, panel, y);
  svg.frame(panel.corner, panel.width, panel.height, kFrame);
  Labels labels(panel);
  for (const Series& s : series) {
    std::vector<Place> places;
    for (const Place& p : s.points) places.push_back({xOf(panel, x, p[0]), yOf(panel, y, p[1])});
    if (s.joined && places.size() > 1) svg.polyline(places, {s.colour, 1.5, s.dash});
    for (const Place& p : places) {
      if (s.dots) svg.circle(p, 4.5, s.colour, "white");
    }
  }
  for (const Series& s : series) {
    for (std::size_t n = 0; n < s.labels.size(); ++n) {
      labels.draw(svg, {xOf(panel, x, s.points[n][0]), yOf(panel, y, s.points[n][1])}, s.labels[n], s.colour);
    }
  }
}

void drawLevel(Svg& svg, const Panel& panel, const Axis& y, double value, const std::string& name) {
  const double at = yOf(panel, y, value);
  const bool room_above = at - panel.corner[1] > 20;
  svg.line({panel.corner[0], at}, {panel.corner[0] + panel.width, at}, kLevel);
  svg.text({panel.corner[0] + panel.width - 6, room_above ? at - 5 : at + 13}, name, {11, Anchor::End, kLevel.colour});
}

void drawBars(Svg& svg, const Panel& panel, const Axis& y, const std::vector<BarGroup>& groups,
              const std::vector<std::string_view>& colours) {
  drawY(svg, panel, y);
  const double each = panel.width / static_cast<double>(groups.size());
  const double wide = 0.8 * each / static_cast<double>(colours.size());
  const double zero = yOf(panel, y, y.logarithmic ? y.low : std::clamp(0.0, y.low, y.high));
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const double left = panel.corner[0] + each * (static_cast<double>(g) + 0.1);
    for (std::size_t s = 0; s < colours.size(); ++s) {
      const double value = groups[g].values[s], from = left + wide * static_cast<double>(s);
      if (!std::isfinite(value)) {
        svg.text({from + wide / 2, zero - 4}, "\xC3\x97", {12, Anchor::Middle, colours[s]});
        continue;
      }
      const double to = yOf(panel, y, value);
      svg.rect({from, std::min(to, zero)}, wide - 2, std::max(std::abs(to - zero), 0.5), colours[s]);
      svg.text({from + wide / 2 - 1, std::min(to, zero) - 4}, shortNumber(value), {9, Anchor::Middle, "#444"});
    }
    svg.text({left + 0.4 * each, panel.corner[1] + panel.height + 16}, groups[g].name, {11, Anchor::Middle});
  }
  svg.line({panel.corner[0], zero}, {panel.corner[0] + panel.width, zero}, kFrame);
  svg.frame(panel.corner, panel.width, panel.height, kFrame);
}

void drawLegend(Svg& svg, const Place& at, const std::vector<std::string>& names,
                const std::vector<std::string_view>& colours) {
  double x = at[0];
  for (std::size_t n = 0; n < names.size(); ++n) {
    svg.circle({x + 5, at[1] - 4}, 5, colours[n]);
    svg.text({x + 15, at[1]}, names[n], {12});
    x += 34 + 7 * static_cast<double>(names[n].size());
  }
}

}  // namespace spinaltap::plots
