#include "server/jobs/tradeoff_plots.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string_view>

#include "server/plots/chart.h"

namespace spinaltap::jobs {
namespace {

using plots::Place;
using tradeoff::Measured;

const std::vector<std::string> kNames{"pixel", "normal", "subvoxel"};
const std::vector<std::string_view> kOnWhite{"#c8442f", "#b58100", "#1668b8"};
const std::vector<std::string_view> kOnCt{"#ff6a55", "#ffc23d", "#4fc3ff"};
constexpr std::string_view kTruth = "#7dff7a";

std::string smoothingText(const Measured& m) {
  if (m.setting.smoothing < 0) return "auto";
  return "s=" + plots::shortNumber(m.setting.smoothing);
}

bool isReport(const Measured& m) {
  return m.setting.reduce_mm == 0 &&
         std::count(kReportSmoothings.begin(), kReportSmoothings.end(), m.setting.smoothing) != 0;
}

const char* errorTitle(bool truth_known) {
  return truth_known ? "distance to the truth, RMS, mm" : "distance to held-out points, RMS, mm";
}

std::string errorAgainstTime(const std::vector<Measured>& rows, bool truth_known) {
  std::vector<plots::Series> series;
  std::vector<double> xs, ys;
  for (std::size_t method = 0; method < kNames.size(); ++method) {
    plots::Series s{kNames[method], kOnWhite[method], {}, {}, false};
    for (const Measured& m : rows) {
      if (static_cast<std::size_t>(m.setting.method) != method || !m.fault.empty() || m.fit_s <= 0) continue;
      s.points.push_back({m.fit_s, m.surface.rms_mm});
      std::string label = smoothingText(m);
      if (m.setting.reduce_mm > 0) label = "auto, reduced to " + plots::shortNumber(m.setting.reduce_mm);
      if (m.setting.tolerance_mm != 0.01) label += ", tol. " + plots::shortNumber(m.setting.tolerance_mm);
      s.labels.push_back(label);
      xs.push_back(m.fit_s), ys.push_back(m.surface.rms_mm);
    }
    series.push_back(std::move(s));
  }
  plots::Svg svg(860, 520);
  const plots::Panel panel{{80, 60}, 740, 390, "What a surface costs, and how true it is"};
  plots::drawPoints(svg, panel, plots::axisFor("fit, seconds", xs, true, false),
                    plots::axisFor(errorTitle(truth_known), ys, true, false), series);
  plots::drawLegend(svg, {80, 506}, kNames, kOnWhite);
  svg.text({820, 506}, "s = smoothing, mm; tolerance 0.01 mm unless given", {11, plots::Anchor::End, "#555"});
  return svg.str();
}

std::string whatSmoothingDoes(const std::vector<Measured>& rows, bool truth_known) {
  struct Quantity {
    const char *title, *unit;
    double (*of)(const Measured&);
    bool logarithmic;
  };
  const Quantity quantities[] = {
      {"Error", errorTitle(truth_known), [](const Measured& m) { return m.surface.rms_mm; }, false},
      {"Swelling", truth_known ? "volume, % of the true one" : "volume, % of the label's",
       [](const Measured& m) { return m.volume_change_percent; }, false},
      {"Roughness", "RMS height over 3 mm, mm", [](const Measured& m) { return m.roughness_mm; }, false}};
  plots::Svg svg(1380, 380);
  double left = 70;
  for (const Quantity& q : quantities) {
    std::vector<plots::BarGroup> groups;
    std::vector<double> all;
    for (const double smoothing : kReportSmoothings) {
      plots::BarGroup group{"smoothing " + plots::shortNumber(smoothing),
                            std::vector<double>(kNames.size(), std::numeric_limits<double>::quiet_NaN())};
      for (const Measured& m : rows) {
        if (!isReport(m) || m.setting.smoothing != smoothing || !m.fault.empty()) continue;
        group.values[static_cast<std::size_t>(m.setting.method)] = q.of(m);
        all.push_back(q.of(m));
      }
      groups.push_back(std::move(group));
    }
    plots::drawBars(svg, {{left, 50}, 370, 250, q.title}, plots::axisFor(q.unit, all, q.logarithmic, true), groups,
                    kOnWhite);
    left += 450;
  }
  plots::drawLegend(svg, {70, 360}, kNames, kOnWhite);
  return svg.str();
}

std::string whatReductionCosts(const std::vector<Measured>& rows, bool truth_known) {
  plots::Series error{"error", kOnWhite[2], {}, {}, true}, rate = error;
  std::vector<double> centres, errors, rates;
  for (const Measured& m : rows) {
    if (m.setting.method != surface::Method::Subvoxel || m.setting.smoothing >= 0 || m.setting.tolerance_mm != 0.01 ||
        !m.fault.empty()) {
      continue;
    }
    const auto count = static_cast<double>(m.centres);
    error.points.push_back({count, m.surface.rms_mm});
    rate.points.push_back({count, m.points_per_s / 1e6});
    const std::string label =
        m.setting.reduce_mm > 0 ? "to " + plots::shortNumber(m.setting.reduce_mm) + " mm" : "not reduced";
    error.labels.push_back(label), rate.labels.push_back(label);
    centres.push_back(count), errors.push_back(m.surface.rms_mm), rates.push_back(m.points_per_s / 1e6);
  }
  plots::Svg svg(960, 380);
  const auto x = plots::axisFor("centres", centres, true, false);
  plots::drawPoints(svg, {{80, 50}, 360, 260, "What reduction loses"}, x,
                    plots::axisFor(errorTitle(truth_known), errors, false, true), {error});
  plots::drawPoints(svg, {{560, 50}, 360, 260, "What it gains"}, x,
                    plots::axisFor("million values a second", rates, false, true), {rate});
  return svg.str();
}

std::vector<std::string> pathsOf(const std::vector<tradeoff::Polyline>& lines, const Place& corner, double scale) {
  std::vector<std::string> out;
  for (const auto& line : lines) {
    std::string d = "M";
    for (const auto& p : line)
      d += plots::px(corner[0] + p[0] * scale) + " " + plots::px(corner[1] + p[1] * scale) + " ";
    out.push_back(std::move(d));
  }
  return out;
}

void drawView(plots::Svg& svg, const View& view, std::size_t smoothing, const Place& corner, double width) {
  const double scale = width / view.plane.width_mm, height = view.plane.height_mm * scale;
  svg.clipTo(corner, width, height);
  svg.rect(corner, width, height, "#1b1e24");
  if (!view.picture.empty()) svg.image(corner, width, height, view.picture);
  svg.lines(pathsOf(view.truth, corner, scale), {kTruth, 2.2, ""});
  for (std::size_t method = 0; method < kNames.size(); ++method) {
    svg.lines(pathsOf(view.methods[method][smoothing], corner, scale), {kOnCt[method], 1.1, ""});
  }
  svg.endClip();
  const Place bar{corner[0] + 10, corner[1] + height - 12};
  svg.line(bar, {bar[0] + view.scale_bar_mm * scale, bar[1]}, {"white", 3, ""});
  svg.text({bar[0], bar[1] - 6}, plots::shortNumber(view.scale_bar_mm) + " mm", {11, plots::Anchor::Start, "white"});
}

std::string outlines(const std::string& title, const std::vector<View>& all, bool along_axis, bool truth_known) {
  std::vector<View> views;
  std::copy_if(all.begin(), all.end(), std::back_inserter(views),
               [&](const View& v) { return v.along_axis == along_axis; });
  constexpr double kWidth = 320, kGap = 16, kLeft = 40, kTop = 70;
  double height = kTop;
  for (const View& v : views) height += kWidth * v.plane.height_mm / v.plane.width_mm + kGap;
  plots::Svg svg(kLeft + kReportSmoothings.size() * (kWidth + kGap), height + 10);
  svg.text({kLeft, 24}, title, {15, plots::Anchor::Start, "#111", true});
  std::vector<std::string> names = kNames;
  std::vector<std::string_view> colours = kOnCt;
  if (truth_known) names.emplace_back("truth"), colours.push_back(kTruth);
  plots::drawLegend(svg, {kLeft + 480, 24}, names, colours);
  double top = kTop;
  for (const View& view : views) {
    const double tall = kWidth * view.plane.height_mm / view.plane.width_mm;
    svg.text({kLeft - 12, top + tall / 2}, view.name, {13, plots::Anchor::Middle, "#222", false, true});
    for (std::size_t s = 0; s < kReportSmoothings.size(); ++s) {
      const double left = kLeft + static_cast<double>(s) * (kWidth + kGap);
      if (top == kTop) {
        svg.text({left + kWidth / 2, kTop - 10}, "smoothing " + plots::shortNumber(kReportSmoothings[s]) + " mm",
                 {13, plots::Anchor::Middle});
      }
      drawView(svg, view, s, {left, top}, kWidth);
    }
    top += tall + kGap;
  }
  return svg.str();
}

}  // namespace

std::vector<Picture> picturesOf(const std::vector<Measured>& rows, const std::vector<View>& views, bool truth_known) {
  return {{"error_against_time.svg", errorAgainstTime(rows, truth_known)},
          {"smoothing.svg", whatSmoothingDoes(rows, truth_known)},
          {"reduction.svg", whatReductionCosts(rows, truth_known)},
          {"silhouettes.svg", outlines("Silhouettes: the whole bone, by method", views, true, truth_known)},
          {"sections.svg", outlines("Sections: what each method makes of the CT", views, false, truth_known)}};
}

}  // namespace spinaltap::jobs
