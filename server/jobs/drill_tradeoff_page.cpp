#include "server/jobs/drill_tradeoff_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "server/jobs/drill_tradeoff_job.h"
#include "server/jobs/tradeoff_page.h"

namespace spinaltap::jobs {
namespace {

using plots::escaped;
using plots::shortNumber;

double number(const Figures& row, const char* key) { return row[key].get<double>(); }

/// Ticks at what was measured; of places too close together for their numbers, the finest.
std::vector<double> ticksAt(const plots::Axis& axis, std::vector<double> places) {
  std::sort(places.begin(), places.end());
  const double apart = std::pow(axis.high / axis.low, 0.1);
  std::vector<double> ticks;
  for (const double place : places) {
    if (ticks.empty() || place >= ticks.back() * apart) ticks.push_back(place);
  }
  return ticks;
}

/// By spacing.
std::string drawn(const PageChart& chart) {
  std::vector<double> xs;
  for (const PageLine& line : chart.lines) {
    for (const plots::Place& p : line.points) xs.push_back(p[0]);
  }
  plots::Axis x = plots::axisFor("spacing, mm", xs, true, false);
  x.ticks = ticksAt(x, xs);
  return figureOf(chart, x);
}

/// One line for each setting that differs in what is told apart, by spacing.
std::vector<PageLine> linesOf(const Figures& rows, const char* key, bool by_precision, bool by_threads) {
  std::vector<PageLine> lines;
  for (const Figures& row : rows) {
    const std::string precision = row["precision"];
    const int threads = row["threads"];
    std::string name = by_precision ? precision : "";
    if (by_threads)
      name += (name.empty() ? "" : ", ") + std::to_string(threads) + (threads == 1 ? " thread" : " threads");
    auto line = std::find_if(lines.begin(), lines.end(), [&](const PageLine& l) { return l.name == name; });
    if (line == lines.end()) {
      const bool single = by_precision && precision == "single", dashed = by_threads ? threads != 1 : single;
      line = lines.insert(lines.end(), {name, single ? kRed : kBlue, dashed ? "6 3" : "", {}});
    }
    const double x = number(row, "spacing_mm"), y = std::abs(number(row, key));
    const bool there =
        std::any_of(line->points.begin(), line->points.end(), [&](const plots::Place& p) { return p[0] == x; });
    if (!there && y > 0) line->points.push_back({x, y});
  }
  for (PageLine& line : lines) std::sort(line.points.begin(), line.points.end());  // asked for in any order
  return lines;
}

std::vector<PageChart> chartsOf(const Figures& figures) {
  const Figures& rows = figures["rows"];
  const std::string budget =
      shortNumber(number(figures, "rate_hz")) + " Hz, headroom " + shortNumber(number(figures, "headroom"));
  const auto shared = [&](PageLine line, const char* name, std::string_view dash) {
    line.name = name, line.dash = dash;
    return line;
  };
  std::vector<PageChart> charts{
      {"A cycle, p99.9", "microseconds", "One cycle in a thousand takes longer. Below the dotted line the rate holds.",
       linesOf(rows, "p999_us", true, true), number(figures, "budget_us"), budget},
      {"A cycle, median", "microseconds", "Half of the cycles take longer.", linesOf(rows, "median_us", true, true), 0,
       ""},
      {"Removed volume",
       "error, %",
       "Against the swept volume, without its sign. Below the dotted line nothing is certain.",
       {shared(linesOf(rows, "removed_error_percent", false, false)[0], "all of the hole", ""),
        [&] {
          PageLine line = shared(linesOf(rows, "cycle_error_percent", false, false)[0], "a cycle's mass, mean", "6 3");
          line.colour = kRed;
          return line;
        }()},
       number(figures, "swept_error_percent"),
       "what the swept volume is known to"},
      {"Ripple of the mass removed a cycle",
       "% of the mean",
       "How unevenly an even motion meets the points.",
       {shared(linesOf(rows, "ripple_percent", false, false)[0], "each cycle", ""),
        [&] {
          PageLine line =
              shared(linesOf(rows, "ripple_smoothed_percent", false, false)[0], "smoothed over 20 ms", "6 3");
          line.colour = kRed;
          return line;
        }()},
       0,
       ""},
      {"Memory", "MB", "Of the point volume and the engine.", linesOf(rows, "memory_mb", true, false), 0, ""},
      {"Building the point volume", "seconds", "Of a path of this length through the phantom.",
       linesOf(rows, "build_s", false, true), 0, ""}};
  return charts;
}

std::string tableOf(const Figures& figures) {
  std::optional<std::size_t> best;
  if (figures.contains("recommended_row")) best = figures["recommended_row"].get<std::size_t>();
  return htmlTable(drillColumns(), figures["rows"], "rows",
                   "Every setting that was measured; what the columns mean stands below.", best);
}

/// Single against double, at each spacing and number of threads.
std::string singleOf(const Figures& figures) {
  std::string out =
      "<p>Time of a cycle in single precision, over that in double; and how many points it leaves standing or removes "
      "otherwise: in this scene, and in the scene <code>on</code>, where a ring is exactly as wide as the bit and "
      "single "
      "precision may tear it.</p>\n<div class=\"scroll\" role=\"region\" aria-label=\"Single against double "
      "precision\" tabindex=\"0\">\n<table>\n<thead><tr>";
  for (const char* title : {"mm", "threads", "median", "p99.9", "differing", "on", "of removed"}) {
    out += std::string("<th scope=\"col\">").append(title).append("</th>");
  }
  out += "</tr></thead>\n<tbody>\n";
  const auto cell = [&](const std::string& text) { out += "<td>" + text + "</td>"; };
  const auto ratio = [&](double a, double b) { cell(b > 0 ? shortNumber(a / b) : "-"); };
  for (const Figures& single : figures["rows"]) {
    for (const Figures& twin : figures["rows"]) {
      if (single["precision"] != "single" || twin["precision"] != "double" || single["threads"] != twin["threads"] ||
          single["spacing_mm"] != twin["spacing_mm"]) {
        continue;
      }
      out += "<tr><th scope=\"row\">" + shortNumber(number(single, "spacing_mm")) + "</th>";
      cell(single["threads"].dump());
      ratio(number(single, "median_us"), number(twin, "median_us"));
      ratio(number(single, "p999_us"), number(twin, "p999_us"));
      cell(single["differing"].dump()), cell(single["differing_on"].dump()), cell(twin["removed"].dump());
      out += "</tr>\n";
    }
  }
  return out + "</tbody>\n</table>\n</div>\n";
}

std::string howOf(const Figures& f) {
  const auto text = [&](const char* key) { return shortNumber(number(f, key)); };
  std::string where = f["processor"].get<std::string>();
  if (!where.empty()) where = " on " + where;
  return "<p>Scene " + escaped(f["scene"].get<std::string>()) + " over " + text("length_mm") +
         " mm: " + text("cycles") + " cycles of a millisecond" + escaped(where) + ", " + text("hardware_threads") +
         " hardware threads. Every cycle counts with its fastest of " + text("repeats") +
         " runs, so that what else the machine does is left out: the headroom is for that.</p>\n<p>The bone is solid, "
         "and what "
         "the bit truly sweeps in it, " +
         text("swept_mm3") +
         " mm\xC2\xB3, is integrated along columns without any "
         "lattice, to " +
         text("swept_error_percent") + " % (a cycle's share, to " + text("swept_cycle_error_percent") +
         " %). Mass a cycle is measured once the bit's cone is in, over " + text("steady_cycles") +
         " cycles. Building is timed on the phantom's surface, an RBF of " + text("centres") +
         " centres, whose sums and bound take " + text("sums_s") + " s more, once a path.</p>\n";
}

}  // namespace

std::string drillTradeoffPage(const Figures& figures) {
  std::string body = "<div class=\"charts\">\n";
  for (const PageChart& chart : chartsOf(figures)) body += drawn(chart);
  body += "</div>\n<h2>Every setting</h2>\n" + tableOf(figures);
  body += "<h2>What single precision costs and gains</h2>\n" + singleOf(figures);
  body += "<h2>What the columns mean</h2>\n" + meaningsOf(drillColumns());
  body += "<h2>How it was measured</h2>\n" + howOf(figures);
  const std::array advice{figures["recommendation"].get<std::string>()};
  return pageOf("speed for accuracy in drilling", "Drilling: speed for accuracy", advice, body);
}

}  // namespace spinaltap::jobs
