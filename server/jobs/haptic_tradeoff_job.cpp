#include "server/jobs/haptic_tradeoff_job.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "server/jobs/haptic_tradeoff_page.h"
#include "server/jobs/words.h"

namespace spinaltap::jobs {
namespace {

using plots::shortNumber;
using tradeoff::HapticCase;
using tradeoff::HapticMeasured;

/// What is shown over time: the plunge through the far wall, a busy network away.
HapticCase tellingCase(const tradeoff::HapticGrid& grid) {
  HapticCase telling;
  telling.bone = tradeoff::Bone::ThroughTheWall, telling.holding = tradeoff::Holding::Leaning;
  telling.rate_hz = 1000, telling.delay_ms = 20;
  telling.seconds = grid.seconds;
  return telling;
}
constexpr std::size_t kTraceEach_ms = 4;

Figures settingOf(const HapticCase& c) {
  return {{"rate_hz", c.rate_hz},
          {"delay_ms", c.delay_ms},
          {"jitter_ms", c.jitter_ms},
          {"loss", c.loss},
          {"way", c.extrapolate ? "extrapolated" : "as answered"}};
}

Figures rowOf(const HapticMeasured& m) {
  Figures row{{"bone", std::string(tradeoff::nameOf(m.setting.bone))},
              {"holding", std::string(haptics::nameOf(m.setting.holding))}};
  row.update(settingOf(m.setting));
  row["coupling_N_mm"] = shortened(m.setting.coupling.stiffness_N_mm);
  const tradeoff::HapticResult& r = m.result;
  row.update(Figures{{"force_mean_N", shortened(r.force_mean_N)},
                     {"force_rms_N", shortened(r.force_rms_N)},
                     {"force_rms_percent", shortened(100 * m.errorShare())},
                     {"overshoot_mm", shortened(r.overshoot_mm)},
                     {"swing_mm", shortened(r.swing_mm)},
                     {"given_mJ", r.given_mJ > kGiven_mJ ? shortened(r.given_mJ) : 0.0},
                     {"depth_mm", shortened(r.depth_mm)},
                     {"late", r.late},
                     {"lost", r.lost}});
  return row;
}

Figures rowOf(const tradeoff::StiffestMeasured& m) {
  Figures row = settingOf(m.setting);
  row.update(Figures{{"guard", m.setting.guard},
                     {"stiffest_N_mm", shortened(m.stiffest_N_mm)},
                     {"theory_N_mm", shortened(m.theory_N_mm)}});
  return row;
}

bool sameNetwork(const HapticCase& a, const HapticCase& b) {
  return a.rate_hz == b.rate_hz && a.delay_ms == b.delay_ms && a.jitter_ms == b.jitter_ms && a.loss == b.loss;
}

/// Of a rate and network one row, both ways side by side: over all bones and hands.
Figures summaryOf(const std::vector<HapticMeasured>& rows, const std::vector<tradeoff::StiffestMeasured>& stiffest) {
  Figures summary = Figures::array();
  for (std::size_t n = 0; n < stiffest.size(); n += 4) {  // two ways, without the guard and with it
    const HapticCase& setting = stiffest[n].setting;
    Figures line = settingOf(setting);
    line.erase("way");
    for (const bool extrapolate : {false, true}) {
      double sum = 0, worst = 0, given = 0, count = 0;
      for (const HapticMeasured& row : rows) {
        if (!sameNetwork(row.setting, setting) || row.setting.extrapolate != extrapolate) continue;
        sum += row.errorShare(), ++count;
        worst = std::max(worst, row.errorShare()), given = std::max(given, row.result.given_mJ);
      }
      const std::string way = extrapolate ? "extrapolated_" : "answered_";
      line[way + "percent"] = shortened(100 * sum / count);
      line[way + "worst_percent"] = shortened(100 * worst);
      line[way + "given_mJ"] = given > kGiven_mJ ? shortened(given) : 0.0;
      const std::size_t at = n + (extrapolate ? 2 : 0);
      line[way + "bare_N_mm"] = shortened(stiffest[at].stiffest_N_mm);
      line[way + "guarded_N_mm"] = shortened(stiffest[at + 1].stiffest_N_mm);
    }
    line["theory_N_mm"] = shortened(stiffest[n].theory_N_mm);
    summary.push_back(std::move(line));
  }
  return summary;
}

Figures traceOf(const tradeoff::ForceCourses& courses, const HapticCase& telling) {
  Figures trace{{"bone", std::string(tradeoff::nameOf(telling.bone))},
                {"holding", std::string(haptics::nameOf(telling.holding))},
                {"rate_hz", telling.rate_hz},
                {"delay_ms", telling.delay_ms}};
  for (const char* key : {"t_s", "ideal_N", "answered_N", "extrapolated_N"}) trace[key] = Figures::array();
  for (std::size_t n = 0; n < courses.ideal_N.size(); n += kTraceEach_ms) {
    trace["t_s"].push_back(shortened(courses.answered.t_s[n]));
    trace["ideal_N"].push_back(shortened(courses.ideal_N[n]));
    trace["answered_N"].push_back(shortened(courses.answered.force_N[n]));
    trace["extrapolated_N"].push_back(shortened(courses.extrapolated.force_N[n]));
  }
  return trace;
}

double number(const Figures& row, const char* key) { return row[key].get<double>(); }

bool isSteady(const Figures& line) { return number(line, "jitter_ms") == 0 && number(line, "loss") == 0; }

std::string joined(const std::vector<std::string>& parts) {
  std::string out;
  for (const std::string& part : parts) out += (out.empty() ? "" : ", ") + part;
  return out;
}

/// At each rate: from which delay on `holds` of a line of the summary.
template <class Holds>
std::string delaysOf(const Figures& figures, const Holds& holds) {
  std::vector<std::string> parts;
  for (const Figures& rate : figures["rates_hz"]) {
    std::string from = "at none of these";
    for (const Figures& line : figures["summary"]) {
      if (line["rate_hz"] != rate || !isSteady(line) || !holds(line)) continue;
      from = "from " + shortNumber(number(line, "delay_ms")) + " ms on";
      break;
    }
    parts.push_back(shortNumber(rate.get<double>()) + " Hz " + from);
  }
  return joined(parts);
}

std::string adviceOnForce(const Figures& figures) {
  const auto wrong = [](const char* key) {
    return [key](const Figures& line) { return number(line, key) > kFelt_percent; };
  };
  return "As answered, the force is wrong by more than " + shortNumber(kFelt_percent) +
         " % of itself, mean over bones and hands: " + delaysOf(figures, wrong("answered_percent")) +
         "; extrapolated: " + delaysOf(figures, wrong("extrapolated_percent")) + ". Extrapolation is the better one: " +
         delaysOf(figures,
                  [](const Figures& line) {
                    return number(line, "extrapolated_percent") < number(line, "answered_percent");
                  }) +
         ".";
}

/// The longest of the delays, at the rate next to 1 kHz.
std::string adviceOnStiffness(const Figures& figures) {
  const Figures* telling = nullptr;
  const auto away = [](const Figures& line) { return std::abs(number(line, "rate_hz") - 1000); };
  for (const Figures& line : figures["summary"]) {
    if (isSteady(line) && (telling == nullptr || away(line) <= away(*telling))) telling = &line;
  }
  const auto text = [&](const char* key) { return shortNumber(number(*telling, key)); };
  std::vector<std::string> softer;
  for (const Figures& rate : figures["rates_hz"]) {
    const double used = tradeoff::couplingOf(tradeoff::Holding::Relaxed, rate.get<double>()).stiffness_N_mm;
    if (used < haptics::kStiffness_N_mm)
      softer.push_back(shortNumber(used) + " at " + shortNumber(rate.get<double>()) + " Hz");
  }
  return "At " + text("rate_hz") + " Hz and " + text("delay_ms") + " ms a relaxed hand can hold a wall of " +
         text("answered_bare_N_mm") + " N/mm as answered and " + text("extrapolated_bare_N_mm") +
         " extrapolated; with the guard " + text("answered_guarded_N_mm") + " and " +
         text("extrapolated_guarded_N_mm") + ". Theory gives a wall without delay " + text("theory_N_mm") + "." +
         " Hands drill with " + shortNumber(haptics::kStiffness_N_mm) + " N/mm, or with " +
         shortNumber(haptics::kCouplingMargin) + " of what theory allows where that is less" +
         (softer.empty() ? "." : ": a relaxed one with " + joined(softer) + ".");
}

/// Cases that differ by the network alone, and the most energy that one of them made.
struct Made {
  std::string name;
  double most_mJ = 0;
};

/// Which cases made energy, one way: their number, and by bone, hand and rate, the worst first, those that made more
/// than kNamed_mJ (every one stands in the rows).
std::string energyOf(const Figures& figures, const char* way) {
  constexpr double kNamed_mJ = 0.01;
  constexpr std::size_t kNamed = 12;
  std::vector<Made> made;
  std::size_t cases = 0, giving = 0, less = 0;
  for (const Figures& row : figures["rows"]) {
    if (row["way"] != way) continue;
    ++cases;
    const double given = number(row, "given_mJ");
    giving += given > 0 ? 1 : 0;
    less += given > 0 && given <= kNamed_mJ ? 1 : 0;
    if (given <= kNamed_mJ) continue;
    const std::string name = row["bone"].get<std::string>() + " " + row["holding"].get<std::string>() + " " +
                             shortNumber(number(row, "rate_hz")) + " Hz";
    auto at = std::find_if(made.begin(), made.end(), [&](const Made& m) { return m.name == name; });
    if (at == made.end()) at = made.insert(at, {name, 0});
    at->most_mJ = std::max(at->most_mJ, given);
  }
  std::sort(made.begin(), made.end(), [](const Made& a, const Made& b) { return a.most_mJ > b.most_mJ; });
  std::vector<std::string> parts;
  for (std::size_t n = 0; n < std::min(made.size(), kNamed); ++n) {
    parts.push_back(made[n].name + " " + shortNumber(made[n].most_mJ));
  }
  if (made.size() > kNamed) {
    parts.push_back(std::to_string(made.size() - kNamed) + " more bones, hands and rates at most " +
                    shortNumber(made[kNamed].most_mJ));
  }
  if (less > 0) parts.push_back(std::to_string(less) + " cases at most " + shortNumber(kNamed_mJ));
  return std::string(way) + " in " + std::to_string(giving) + " of " + std::to_string(cases) + " cases" +
         (parts.empty() ? "" : " (" + joined(parts) + ")");
}

std::string adviceOnEnergy(const Figures& figures) {
  return "With the guard the port gave more energy than it had taken, in mJ: " + energyOf(figures, "extrapolated") +
         "; " + energyOf(figures, "as answered") + ".";
}

constexpr std::array kSummary{
    TableColumn{"Hz", "rate_hz", "rate of the device's loop: a pose is sent each time"},
    TableColumn{"delay", "delay_ms", "there and back, ms"},
    TableColumn{"jitter", "jitter_ms", "each message later by up to so much, each way, ms: they overtake each other"},
    TableColumn{"lost", "loss", "share of the messages that is lost, each way"},
    TableColumn{"answ %", "answered_percent",
                "the last answer's force is felt: RMS error against the ideal, of the mean force; mean over the cases"},
    TableColumn{"worst", "answered_worst_percent", "the same of the worst case"},
    TableColumn{"extra %", "extrapolated_percent", "the local model's force is felt: as answ %"},
    TableColumn{"worst", "extrapolated_worst_percent", "the same of the worst case"},
    TableColumn{"answ mJ", "answered_given_mJ", "most energy that the port gave beyond what it took, of all cases"},
    TableColumn{"extra mJ", "extrapolated_given_mJ", "the same, extrapolated"},
    TableColumn{
        "answ K", "answered_bare_N_mm",
        "stiffest coupling with which a relaxed hand rests at a wall, as answered, N/mm: 200 is the most tried"},
    TableColumn{"guarded", "answered_guarded_N_mm", "the same with the passivity guard"},
    TableColumn{"extra K", "extrapolated_bare_N_mm", "as answ K, extrapolated"},
    TableColumn{"guarded", "extrapolated_guarded_N_mm", "the same with the passivity guard"},
    TableColumn{"2 b / T", "theory_N_mm", "theory's stiffest sampled wall without delay (Colgate and Schenkel 1997)"}};

constexpr std::array kColumns{
    TableColumn{"bone", "bone", "cortex or cancellous bone without end, or a vertebra's layers and out again"},
    TableColumn{"hand", "holding", "relaxed, tense or trembling at 2 mm/s of feed; leaning pushes with 25 N"},
    TableColumn{"Hz", "rate_hz", "as above"},
    TableColumn{"delay", "delay_ms", "as above"},
    TableColumn{"jitter", "jitter_ms", "as above"},
    TableColumn{"lost", "loss", "as above"},
    TableColumn{"way", "way", "which force is felt"},
    TableColumn{"mean N", "force_mean_N", "of the ideal"},
    TableColumn{"RMS N", "force_rms_N", "difference to the ideal"},
    TableColumn{"RMS %", "force_rms_percent", "the same, of the mean"},
    TableColumn{"over mm", "overshoot_mm", "deepest of the bit, beyond the ideal's deepest"},
    TableColumn{"swing mm", "swing_mm", "peak to peak of the hand about its mean course of 0.1 s, in the last quarter"},
    TableColumn{"mJ", "given_mJ", "energy that the port gave beyond what it took"},
    TableColumn{"late", "late", "poses that came after newer ones, and were refused"},
    TableColumn{"lost", "lost", "messages lost on the way"}};

/// @pre the grid was checked.
Result<Figures> measured(const HapticTradeoffJob& job, const Progress& progress) {
  constexpr double kCases = 0.55;  // of the whole time
  const auto part = [&](const char* stage, double from, double share) -> tradeoff::HapticProgress {
    return [&progress, stage, from, share](double done) {
      if (progress) progress(stage, from + share * done);
    };
  };
  const auto rows = measureHaptics(job.grid, part("hands", 0, kCases));
  if (!rows) return tl::unexpected(rows.error());
  const auto stiffest = measureStiffest(job.grid, part("walls", kCases, 1 - kCases));
  if (!stiffest) return tl::unexpected(stiffest.error());
  const HapticCase telling = tellingCase(job.grid);
  const auto courses = forceCourses(telling);
  if (!courses) return tl::unexpected(courses.error());

  Figures figures{{"rates_hz", job.grid.rates_hz},      {"delays_ms", job.grid.delays_ms},
                  {"jitter_ms", job.grid.jitter_ms},    {"loss", job.grid.loss},
                  {"seconds", job.grid.seconds},        {"rows", Figures::array()},
                  {"stiffest", Figures::array()},       {"summary", summaryOf(*rows, *stiffest)},
                  {"trace", traceOf(*courses, telling)}};
  for (const HapticMeasured& row : *rows) figures["rows"].push_back(rowOf(row));
  for (const auto& row : *stiffest) figures["stiffest"].push_back(rowOf(row));
  figures["follows"] = {adviceOnForce(figures), adviceOnStiffness(figures), adviceOnEnergy(figures)};
  return figures;
}

}  // namespace

Result<Figures> hapticTradeoff(const HapticTradeoffJob& job, const Progress& progress) {
  Stopwatch total;
  if (const auto checked = checkGrid(job.grid); !checked) return tl::unexpected(checked.error());
  if (const auto checked = checkPage(job.html); !checked) return tl::unexpected(checked.error());
  auto figures = measured(job, progress);
  if (!figures) return figures;
  if (!job.html.empty()) {
    const auto written = writePage(job.html, hapticTradeoffPage(*figures));
    if (!written) return tl::unexpected(written.error());
    (*figures)["html"] = job.html;
  }
  (*figures)["total_s"] = total.lap_s();
  return figures;
}

std::span<const TableColumn> hapticSummaryColumns() { return kSummary; }
std::span<const TableColumn> hapticColumns() { return kColumns; }

std::string hapticTradeoffTable(const Figures& figures) {
  std::string out = textTable(kSummary, figures["summary"]);
  out +=
      "\nDelay and jitter in ms; force error, RMS in % of the mean force, over 3 bones and 4 hands, and of the worst; "
      "energy\ngiven in mJ; K: stiffest coupling at rest, N/mm (0: none, 200: the most tried); answ: the last answer "
      "is felt, extra: the\nlocal model.\n";
  for (const Figures& text : figures["follows"]) out += text.get<std::string>() + "\n";
  return out;
}

}  // namespace spinaltap::jobs
