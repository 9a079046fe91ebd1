#include "server/jobs/drill_tradeoff_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "server/jobs/drill_tradeoff_job.h"
#include "server/plots/chart.h"

namespace spinaltap::jobs {
namespace {

using plots::escaped;
using plots::shortNumber;

/// A colour of the charts, which are drawn for white paper, and what stands for it on a dark page.
struct Colour {
  std::string_view light, dark;
};
constexpr Colour kBlue{"#1668b8", "#62b5ff"}, kRed{"#b23a26", "#ff8a78"};
constexpr std::array kColours{kBlue,
                              kRed,
                              Colour{"white", "#16191d"},
                              Colour{"#e4e4e4", "#343a41"},
                              Colour{"#888", "#7d858e"},
                              Colour{"#222", "#dfe3e8"},
                              Colour{"#111", "#f1f3f5"},
                              Colour{"#555", "#aab2bb"}};

constexpr std::string_view kStyle = R"(
:root { color-scheme: light dark; --ink: #1d2126; --soft: #555c64; --page: #fff; --line: #d5d9de; --mark: #e4f0fc; }
body { margin: 0; background: var(--page); color: var(--ink); font: 16px/1.5 system-ui, Helvetica, Arial, sans-serif; }
main { max-width: 84rem; margin: 0 auto; padding: 1.5rem; }
h1 { font-size: 1.6rem; margin: 0 0 .5rem; } h2 { font-size: 1.2rem; margin: 2rem 0 .5rem; }
.advice { border-left: .3rem solid #1668b8; background: var(--mark); padding: .6rem 1rem; margin: 1rem 0; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 22rem), 1fr)); gap: 1.2rem; }
figure { margin: 0; } figcaption { color: var(--soft); font-size: .9rem; } svg { width: 100%; height: auto; }
.scroll { overflow-x: auto; } .scroll:focus-visible { outline: .15rem solid #1668b8; outline-offset: .15rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .85rem; }
caption { text-align: left; color: var(--soft); padding-bottom: .4rem; }
th, td { padding: .25rem .35rem; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap; }
thead th { border-bottom: 2px solid var(--line); } tr.best { background: var(--mark); }
dt { font-weight: 600; float: left; clear: left; width: 7rem; } dd { margin: 0 0 .2rem 7.5rem; }
@media (prefers-color-scheme: dark) {
:root { --ink: #dfe3e8; --soft: #aab2bb; --page: #16191d; --line: #343a41; --mark: #1c2c3c; }
)";

std::string style() {
  std::string out(kStyle);
  for (const Colour& colour : kColours) {
    for (const std::string_view property : {"fill", "stroke"}) {
      for (const std::string_view part :
           {std::string_view("svg ["), property, std::string_view("=\""), colour.light, std::string_view("\"] { "),
            property, std::string_view(": "), colour.dark, std::string_view("; }\n")}) {
        out += part;
      }
    }
  }
  return out + "}\n";
}

double number(const Figures& row, const char* key) { return row[key].get<double>(); }

/// A line of a chart: some rows' figure against their spacing.
struct Line {
  std::string name;
  Colour colour;
  std::string_view dash;
  std::vector<plots::Place> points;
};

struct Chart {
  std::string title, unit, caption;
  std::vector<Line> lines;
  double level = 0;  ///< a level across, if positive
  std::string level_name;
};

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

std::string drawn(const Chart& chart) {
  std::vector<double> xs, ys;
  for (const Line& line : chart.lines) {
    for (const plots::Place& p : line.points) xs.push_back(p[0]), ys.push_back(p[1]);
  }
  if (chart.level > 0) ys.push_back(chart.level);
  const plots::Axis y = plots::axisFor(chart.unit, ys, true, false);
  plots::Axis x = plots::axisFor("spacing, mm", xs, true, false);
  x.ticks = ticksAt(x, xs);
  std::vector<plots::Series> series;
  for (const Line& line : chart.lines)
    series.push_back({line.name, line.colour.light, line.points, {}, true, line.dash});
  const plots::Panel panel{{70, 36}, 370, 240, chart.title};
  plots::Svg svg(460, chart.lines.size() > 2 ? 368 : 350);
  plots::drawPoints(svg, panel, x, y, series);
  if (chart.level > 0) plots::drawLevel(svg, panel, y, chart.level, chart.level_name);
  for (std::size_t n = 0; n < chart.lines.size(); ++n) {  // two names a row, at most two rows
    const Line& line = chart.lines[n];
    const double left = panel.corner[0] + (n % 2 == 0 ? 0 : 0.5 * panel.width);
    const double at = n < 2 ? 338 : 356;
    svg.line({left, at}, {left + 26, at}, {line.colour.light, 2, line.dash});
    svg.text({left + 32, at + 4}, line.name, {12});
  }
  return "<figure>\n" + svg.str(chart.title + ". " + chart.caption) + "<figcaption>" + escaped(chart.caption) +
         "</figcaption>\n</figure>\n";
}

/// One line for each setting that differs in what is told apart, by spacing.
std::vector<Line> linesOf(const Figures& rows, const char* key, bool by_precision, bool by_threads) {
  std::vector<Line> lines;
  for (const Figures& row : rows) {
    const std::string precision = row["precision"];
    const int threads = row["threads"];
    std::string name = by_precision ? precision : "";
    if (by_threads)
      name += (name.empty() ? "" : ", ") + std::to_string(threads) + (threads == 1 ? " thread" : " threads");
    auto line = std::find_if(lines.begin(), lines.end(), [&](const Line& l) { return l.name == name; });
    if (line == lines.end()) {
      const bool single = by_precision && precision == "single", dashed = by_threads ? threads != 1 : single;
      line = lines.insert(lines.end(), {name, single ? kRed : kBlue, dashed ? "6 3" : "", {}});
    }
    const double x = number(row, "spacing_mm"), y = std::abs(number(row, key));
    const bool there =
        std::any_of(line->points.begin(), line->points.end(), [&](const plots::Place& p) { return p[0] == x; });
    if (!there && y > 0) line->points.push_back({x, y});
  }
  for (Line& line : lines) std::sort(line.points.begin(), line.points.end());  // asked for in any order
  return lines;
}

std::vector<Chart> chartsOf(const Figures& figures) {
  const Figures& rows = figures["rows"];
  const std::string budget =
      shortNumber(number(figures, "rate_hz")) + " Hz, headroom " + shortNumber(number(figures, "headroom"));
  const auto shared = [&](Line line, const char* name, std::string_view dash) {
    line.name = name, line.dash = dash;
    return line;
  };
  std::vector<Chart> charts{
      {"A cycle, p99.9", "microseconds", "One cycle in a thousand takes longer. Below the dotted line the rate holds.",
       linesOf(rows, "p999_us", true, true), number(figures, "budget_us"), budget},
      {"A cycle, median", "microseconds", "Half of the cycles take longer.", linesOf(rows, "median_us", true, true), 0,
       ""},
      {"Removed volume",
       "error, %",
       "Against the swept volume, without its sign. Below the dotted line nothing is certain.",
       {shared(linesOf(rows, "removed_error_percent", false, false)[0], "all of the hole", ""),
        [&] {
          Line line = shared(linesOf(rows, "cycle_error_percent", false, false)[0], "a cycle's mass, mean", "6 3");
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
          Line line = shared(linesOf(rows, "ripple_smoothed_percent", false, false)[0], "smoothed over 20 ms", "6 3");
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

std::string cellsOf(const Figures& row, bool best) {
  std::string out;
  for (const DrillColumn& column : drillColumns()) {
    const std::string text = escaped(drillCell(row, column));
    if (&column == &drillColumns().front()) {
      out += "<th scope=\"row\">" + text + (best ? " <small>recommended</small>" : "") + "</th>";
    } else {
      out += "<td>" + text + "</td>";
    }
  }
  return out;
}

std::string tableOf(const Figures& figures) {
  std::string out =
      "<div class=\"scroll\" role=\"region\" aria-labelledby=\"rows\" tabindex=\"0\">\n<table>\n<caption "
      "id=\"rows\">Every "
      "setting that was measured; what the columns mean stands below.</caption>\n<thead><tr>";
  for (const DrillColumn& column : drillColumns()) out += "<th scope=\"col\">" + escaped(column.title) + "</th>";
  out += "</tr></thead>\n<tbody>\n";
  for (std::size_t n = 0; n < figures["rows"].size(); ++n) {
    const bool best = figures.contains("recommended_row") && figures["recommended_row"] == n;
    out += (best ? "<tr class=\"best\">" : "<tr>") + cellsOf(figures["rows"][n], best) + "</tr>\n";
  }
  return out + "</tbody>\n</table>\n</div>\n";
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

std::string meaningsOf() {
  std::string out = "<dl>\n";
  for (const DrillColumn& column : drillColumns()) {
    out += "<dt>" + escaped(column.title) + "</dt><dd>" + escaped(column.meaning) + "</dd>\n";
  }
  return out + "</dl>\n";
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
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\" xmlns=\"http://www.w3.org/1999/xhtml\">\n<head>\n<meta "
      "charset=\"utf-8\"/>\n<meta "
      "name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>SpinalTap: speed for accuracy in "
      "drilling</title>\n<style>" +
      style() + "</style>\n</head>\n<body>\n<main>\n<h1>Drilling: speed for accuracy</h1>\n";
  out +=
      "<p class=\"advice\">" + escaped(figures["recommendation"].get<std::string>()) + "</p>\n<div class=\"charts\">\n";
  for (const Chart& chart : chartsOf(figures)) out += drawn(chart);
  out += "</div>\n<h2>Every setting</h2>\n" + tableOf(figures);
  out += "<h2>What single precision costs and gains</h2>\n" + singleOf(figures);
  out += "<h2>What the columns mean</h2>\n" + meaningsOf();
  out += "<h2>How it was measured</h2>\n" + howOf(figures);
  return out + "</main>\n</body>\n</html>\n";
}

}  // namespace spinaltap::jobs
