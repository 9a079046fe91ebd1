#include "server/jobs/haptic_tradeoff_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "server/jobs/haptic_tradeoff_job.h"

namespace spinaltap::jobs {
namespace {

using plots::escaped;
using plots::shortNumber;

constexpr std::string_view kDashed = "6 3", kDotted = "2 4";
constexpr std::array kRateColours{kBlue, kRed, kGreen, kViolet, kOchre, kTeal};
static_assert(kRateColours.size() >= tradeoff::kMostRates);

double number(const Figures& row, const char* key) { return row[key].get<double>(); }
bool isSteady(const Figures& row) { return number(row, "jitter_ms") == 0 && number(row, "loss") == 0; }

/// Delays have their place by ratios from a millisecond on, and by differences below.
double placeOf(double delay_ms) { return std::log2(1 + delay_ms); }

plots::Axis delayAxis(const Figures& figures) {
  std::vector<double> delays = figures["delays_ms"];
  std::sort(delays.begin(), delays.end());
  plots::Axis axis{"delay there and back, ms", placeOf(delays.front()) - 0.4, placeOf(delays.back()) + 0.4};
  const double apart = 0.07 * (axis.high - axis.low);
  for (const double delay : delays) {
    if (!axis.ticks.empty() && placeOf(delay) < axis.ticks.back() + apart) continue;
    axis.ticks.push_back(placeOf(delay));
    axis.names.push_back(shortNumber(delay));
  }
  return axis;
}

/// A line's colour tells the rate, its strokes the way.
std::vector<PageLine> legendOf(const Figures& figures, bool theory) {
  std::vector<PageLine> legend;
  for (const Figures& rate : figures["rates_hz"]) {
    legend.push_back({shortNumber(rate.get<double>()) + " Hz", kRateColours[legend.size()], "", {}});
  }
  legend.push_back({"extrapolated", kGrey, "", {}});
  legend.push_back({"as answered", kGrey, kDashed, {}});
  if (theory) legend.push_back({"theory", kGrey, kDotted, {}});
  return legend;
}

/// A figure over the delay, of those rows that `use` holds, averaged where several share a place: a line each rate and
/// way. What is not above zero has no place on a logarithmic axis and is left out.
template <class Use>
std::vector<PageLine> linesOf(const Figures& figures, const Figures& rows, const char* key, const Use& use) {
  std::vector<PageLine> lines;
  std::vector<double> delays = figures["delays_ms"];
  std::sort(delays.begin(), delays.end());
  for (std::size_t rate = 0; rate < figures["rates_hz"].size(); ++rate) {
    for (const bool extrapolated : {true, false}) {
      PageLine line{"", kRateColours[rate], extrapolated ? "" : kDashed, {}};
      for (const double delay : delays) {
        double sum = 0, count = 0;
        for (const Figures& row : rows) {
          const bool is_there = row["rate_hz"] == figures["rates_hz"][rate] && number(row, "delay_ms") == delay &&
                                (row["way"] == "extrapolated") == extrapolated && isSteady(row) && use(row);
          if (is_there) sum += number(row, key), ++count;
        }
        if (sum > 0) line.points.push_back({placeOf(delay), sum / count});
      }
      lines.push_back(std::move(line));
    }
  }
  return lines;
}

PageChart forceChart(const Figures& figures, tradeoff::Bone bone) {
  const std::string name(tradeoff::nameOf(bone));
  return {
      "Force error: " + name,
      "RMS, % of the mean force",
      "Against the ideal, mean over the four hands. A hand hardly feels what stays below the dotted line.",
      linesOf(figures, figures["rows"], "force_rms_percent", [&](const Figures& row) { return row["bone"] == name; }),
      kFelt_percent,
      shortNumber(kFelt_percent) + " %",
      legendOf(figures, false)};
}

PageChart stiffestChart(const Figures& figures, bool guard) {
  const plots::Axis axis = delayAxis(figures);
  PageChart chart{guard ? "Stiffest coupling, with the guard" : "Stiffest coupling, without the guard", "N/mm",
                  guard
                      ? "With the passivity guard, which brakes away energy that the port gave. 200 is the most tried."
                      : "At which a relaxed hand comes to rest at a wall; theory is 2 b / T, without delay.",
                  linesOf(figures, figures["stiffest"], "stiffest_N_mm",
                          [&](const Figures& row) { return row["guard"] == guard; })};
  chart.legend = legendOf(figures, !guard);
  if (guard) return chart;
  for (std::size_t rate = 0; rate < figures["rates_hz"].size(); ++rate) {
    for (const Figures& row : figures["stiffest"]) {
      if (row["rate_hz"] != figures["rates_hz"][rate]) continue;
      const double theory = number(row, "theory_N_mm");
      chart.lines.push_back({"", kRateColours[rate], kDotted, {{axis.low, theory}, {axis.high, theory}}, false});
      break;
    }
  }
  return chart;
}

std::string traceFigure(const Figures& trace) {
  PageChart chart{"Force over time: " + trace["bone"].get<std::string>() + ", " + trace["holding"].get<std::string>() +
                      ", " + shortNumber(number(trace, "rate_hz")) + " Hz, " + shortNumber(number(trace, "delay_ms")) +
                      " ms",
                  "N, pushing back",
                  "What the hand feels: ideally (20 kHz, no network), from the last answer, and from the local model.",
                  {}};
  struct Of {
    const char *name, *key;
    Colour colour;
    std::string_view dash;
  };
  for (const Of& of : {Of{"as answered", "answered_N", kRed, kDashed}, Of{"extrapolated", "extrapolated_N", kBlue, ""},
                       Of{"ideal", "ideal_N", kGrey, kDotted}}) {
    PageLine line{of.name, of.colour, of.dash, {}, false};
    for (std::size_t i = 0; i < trace["t_s"].size(); ++i) {
      line.points.push_back({trace["t_s"][i].get<double>(), trace[of.key][i].get<double>()});
    }
    chart.lines.push_back(std::move(line));
  }
  chart.logarithmic = false;
  chart.width = 880;
  std::vector<double> times = trace["t_s"];
  plots::Axis x = plots::axisFor("time, s", times, false, true);
  x.high = times.empty() ? 1 : times.back();
  return figureOf(chart, x);
}

std::string howOf(const Figures& f) {
  const auto text = [&](const char* key) { return shortNumber(number(f, key)); };
  return "<p>A simulated hand, a device at the given rate, a network and a session are closed to a loop in simulated "
         "time, " +
         text("seconds") +
         " s a case; the hand moves 20,000 times a second. The ideal is the same hand in a loop of 20 kHz without "
         "network, extrapolation or guard. Either way the passivity guard is on, but for the stiffest couplings that "
         "are called bare.</p>\n<p>As answered, the device pushes with the force of the newest answer. Extrapolated, "
         "it moves a bit of its own through the bone that the newest answer tells of (after Picinbono and Lombardo "
         "1999), and pushes with what that one feels.</p>\n<p>Energy is what the port had given to the hand beyond "
         "what it had taken, at the time when that was most; rounding is below " +
         escaped(shortNumber(kGiven_mJ)) + " mJ and shown as 0.</p>\n";
}

}  // namespace

std::string hapticTradeoffPage(const Figures& figures) {
  const plots::Axis x = delayAxis(figures);
  std::string body = "<div class=\"charts\">\n";
  for (const auto bone : {tradeoff::Bone::Cortex, tradeoff::Bone::Cancellous, tradeoff::Bone::ThroughTheWall}) {
    body += figureOf(forceChart(figures, bone), x);
  }
  for (const bool guard : {false, true}) body += figureOf(stiffestChart(figures, guard), x);
  body += "</div>\n<div class=\"wide\">\n" + traceFigure(figures["trace"]) + "</div>\n";
  body += "<h2>By rate and network</h2>\n" +
          htmlTable(hapticSummaryColumns(), figures["summary"], "summary",
                    "Over three bones and four hands; what the columns mean stands below.") +
          meaningsOf(hapticSummaryColumns());
  body += "<h2>How it was measured</h2>\n" + howOf(figures);
  body += "<h2>Every case</h2>\n" + meaningsOf(hapticColumns()) +
          htmlTable(hapticColumns(), figures["rows"], "rows", "Every case that was measured, with the guard.");
  const std::vector<std::string> advice = figures["follows"];
  return pageOf("rate and delay against force", "Feeling bone: rate and delay against force and stability", advice,
                body);
}

}  // namespace spinaltap::jobs
