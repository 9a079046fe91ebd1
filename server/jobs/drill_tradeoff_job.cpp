#include "server/jobs/drill_tradeoff_job.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "core/tradeoff/drill_tradeoff.h"
#include "server/jobs/build_site.h"
#include "server/jobs/drill_tradeoff_page.h"
#include "server/jobs/words.h"
#include "server/plots/svg.h"

namespace spinaltap::jobs {
namespace {

using plots::shortNumber;
using tradeoff::DrillMeasured;

constexpr double kBytesAPoint = 2.2;   // density, alive bits and the engine, rounded up
constexpr double kLeastLength_mm = 7;  // the bit's cone, and two millimetres of steady cycles

/// What the processor calls itself; empty where that is not told.
std::string processorName() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const auto colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) return line.substr(colon + 2);
  }
  return {};
}

Result<void> check(const DrillTradeoffJob& job) {
  if (job.spacings_mm.empty() || job.threads.empty()) {
    return fail(ErrorCode::InvalidArgument, "trade-off: no spacing, or no number of threads");
  }
  if (!(job.length_mm >= kLeastLength_mm && job.length_mm <= session::kReportLength_mm)) {
    return fail(ErrorCode::InvalidArgument, "trade-off: the path is to be " + shortNumber(kLeastLength_mm) + " to " +
                                                shortNumber(session::kReportLength_mm) + " mm long");
  }
  for (const double spacing : job.spacings_mm) {
    if (!(spacing >= 0.01 && spacing <= 1)) {
      return fail(ErrorCode::InvalidArgument, "trade-off: spacing " + shortNumber(spacing) + " is not 0.01 to 1 mm");
    }
  }
  return checkPage(job.html);
}

/// Before anything runs: whether the finest lattice is too large.
Result<void> checkMemory(const DrillTradeoffJob& job) {
  const auto scene = tradeoff::drillScene(job.scene, job.length_mm, {.columns = 1, .estimates = 2});  // for its reach
  if (!scene) return tl::unexpected(scene.error());
  for (const double spacing : job.spacings_mm) {
    const auto points = static_cast<double>(tradeoff::drillLattice(*scene, spacing).points());
    if (points * kBytesAPoint <= kMostMemory_mb * 1e6) continue;
    return fail(ErrorCode::Limit, "trade-off: spacing " + shortNumber(spacing) + " mm takes " +
                                      shortNumber(shortened(points)) + " points and " +
                                      shortNumber(shortened(points * kBytesAPoint * 1e-6)) + " MB, over the limit of " +
                                      shortNumber(kMostMemory_mb) + ": a shorter --length or coarser points");
  }
  return {};
}

/// `differing_on`: of the same precision in the scene `on`.
Figures rowOf(const DrillMeasured& m, const DrillMeasured& first, std::uint64_t differing_on) {
  const auto ratio = [](double a, double b) { return b > 0 ? shortened(a / b) : 0.0; };
  const auto rate = [](double seconds) { return seconds > 0 ? shortened(1 / seconds) : 0.0; };
  return {{"spacing_mm", m.spacing_mm},
          {"precision", std::string(tradeoff::nameOf(m.precision))},
          {"threads", m.threads},
          {"points", m.points},
          {"memory_mb", shortened(static_cast<double>(m.bytes) * 1e-6)},
          {"bytes_per_point", shortened(static_cast<double>(m.bytes) / static_cast<double>(m.points))},
          {"build_s", shortened(m.build_s)},
          {"median_us", shortened(m.median_s * 1e6)},
          {"p999_us", shortened(m.p999_s * 1e6)},
          {"met_p999_us", shortened(m.met_p999_s * 1e6)},
          {"cycles_per_s", rate(m.median_s)},
          {"cycles_per_s_p999", rate(m.p999_s)},
          {"median_ratio", ratio(m.median_s, first.median_s)},
          {"p999_ratio", ratio(m.p999_s, first.p999_s)},
          {"removed", m.removed},
          {"removed_mm3", m.removed_mm3},
          {"removed_error_percent", shortened(100 * m.removed_error)},
          {"cycle_error_percent", shortened(100 * m.cycle_error)},
          {"ripple_percent", shortened(100 * m.ripple)},
          {"ripple_smoothed_percent", shortened(100 * m.ripple_smoothed)},
          {"differing", m.differing},
          {"differing_on", differing_on}};
}

std::string settingText(const DrillMeasured& row) {
  return shortNumber(row.spacing_mm) + " mm in " + std::string(tradeoff::nameOf(row.precision)) + " precision on " +
         std::to_string(row.threads) + (row.threads == 1 ? " thread" : " threads");
}

std::string adviceOn(const std::vector<DrillMeasured>& rows, const tradeoff::Wanted& wanted,
                     std::optional<std::size_t> best) {
  const std::string asked = shortNumber(wanted.rate_hz) + " cycles a second with headroom " +
                            shortNumber(wanted.headroom) + " (" + shortNumber(wanted.budget_s() * 1e6) + " us a cycle)";
  if (best) {
    const DrillMeasured& row = rows[*best];
    return "Recommended for " + asked + ": " + settingText(row) + ", whose p99.9 cycle takes " +
           shortNumber(row.p999_s * 1e6) + " us; " + shortNumber(static_cast<double>(row.bytes) * 1e-6) +
           " MB, ripple " + shortNumber(100 * row.ripple) + " %." +
           (row.met_p999_s * wanted.rate_hz > 1
                ? " Other work on this machine made it " + shortNumber(row.met_p999_s * 1e6) +
                      " us, longer than a whole cycle: it needs a quieter one, or fewer threads."
                : std::string());
  }
  const auto quickest = std::min_element(
      rows.begin(), rows.end(), [](const DrillMeasured& a, const DrillMeasured& b) { return a.p999_s < b.p999_s; });
  return "None of these holds " + asked + ": the quickest, " + settingText(*quickest) + ", takes " +
         shortNumber(quickest->p999_s * 1e6) + " us at p99.9. Ask for less, or for coarser points.";
}

Figures sceneFigures(const DrillTradeoffJob& job, const tradeoff::DrillScene& scene) {
  const auto steady = static_cast<double>(scene.poses.size() - scene.steady);
  double each = 0;
  for (std::size_t n = scene.steady; n < scene.poses.size(); ++n) each += scene.swept.each_mm3[n] / steady;
  return {{"scene", std::string(session::nameOf(job.scene))},
          {"length_mm", job.length_mm},
          {"cycles", scene.poses.size()},
          {"steady_cycles", scene.poses.size() - scene.steady},
          {"repeats", job.repeats},
          {"processor", processorName()},
          {"hardware_threads", std::thread::hardware_concurrency()},
          {"rate_hz", job.rate_hz},
          {"headroom", job.headroom},
          {"budget_us", tradeoff::Wanted{job.rate_hz, job.headroom}.budget_s() * 1e6},
          {"swept_mm3", scene.swept.total_mm3},
          {"swept_error_percent", shortened(100 * scene.swept.error_mm3 / scene.swept.total_mm3)},
          {"swept_cycle_mm3", shortened(each)},
          {"swept_cycle_error_percent", shortened(100 * scene.swept.each_error_mm3 / each)}};
}

/// A share of the whole's time for each spacing: about as its points.
std::vector<double> sharesOf(const DrillTradeoffJob& job) {
  std::vector<double> ends{0};
  for (const double spacing : job.spacings_mm) ends.push_back(ends.back() + 1 / (spacing * spacing) + 100);
  for (double& end : ends) end /= ends.back();
  return ends;
}

Result<std::vector<DrillMeasured>> measureAll(const DrillTradeoffJob& job, const tradeoff::DrillScene& scene,
                                              BuildSite& site, const Progress& progress) {
  tradeoff::DrillRunOptions options;
  options.threads = job.threads, options.repeats = job.repeats;
  const auto start = std::chrono::steady_clock::now();
  options.clock = [start] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  options.build = [&](const point_volume::Lattice& lattice, int threads) {
    return site.build_s(lattice, threads, job.repeats);
  };
  std::vector<DrillMeasured> rows;
  const std::vector<double> shares = sharesOf(job);
  for (std::size_t n = 0; n < job.spacings_mm.size(); ++n) {
    if (progress) progress("drills", shares[n]);
    const auto measured = tradeoff::measureDrill(scene, job.spacings_mm[n], options);
    if (!measured) return tl::unexpected(measured.error());
    rows.insert(rows.end(), measured->begin(), measured->end());
  }
  return rows;
}

/// Where rings are exactly as wide as the bit, and single precision may tear them: how many points end otherwise than
/// in double, at each spacing.
Result<std::vector<std::uint64_t>> tornBySingle(const DrillTradeoffJob& job) {
  const auto scene = tradeoff::drillScene(session::Scene::On, job.length_mm, {.columns = 1, .estimates = 2});
  if (!scene) return tl::unexpected(scene.error());
  tradeoff::DrillRunOptions options;
  options.threads = {1}, options.repeats = 1;
  std::vector<std::uint64_t> torn;
  for (const double spacing : job.spacings_mm) {
    const auto rows = tradeoff::measureDrill(*scene, spacing, options);
    if (!rows) return tl::unexpected(rows.error());
    torn.push_back(rows->back().differing);
  }
  return torn;
}

constexpr std::array kColumns{
    TableColumn{"mm", "spacing_mm", "spacing of the points"},
    TableColumn{"reals", "precision", "the predicate's arithmetic"},
    TableColumn{"threads", "threads", "that share a cycle"},
    TableColumn{"MB", "memory_mb", "memory of point volume and engine"},
    TableColumn{"build s", "build_s", "to build the point volume of a path of this length in the phantom"},
    TableColumn{"p50 us", "median_us", "a cycle, median"},
    TableColumn{"p99.9 us", "p999_us", "a cycle that one in a thousand exceeds"},
    TableColumn{"as met", "met_p999_us", "the same of all runs, not the fastest: what the machine made of it, us"},
    TableColumn{"cycles/s", "cycles_per_s", "of the median cycle"},
    TableColumn{"at p99.9", "cycles_per_s_p999", "cycles a second, of the p99.9 cycle"},
    TableColumn{"volume %", "removed_error_percent", "error of the removed volume against the swept one"},
    TableColumn{"mass %", "cycle_error_percent", "error of the mass removed a cycle, mean"},
    TableColumn{"ripple %", "ripple_percent", "its standard deviation from what is swept, cycle by cycle"},
    TableColumn{"20 ms %", "ripple_smoothed_percent", "the same after smoothing over 20 ms"},
    TableColumn{"differ", "differing", "points that end otherwise than in the first row of this spacing"},
    TableColumn{"on", "differing_on",
                "the same against double in the scene on, where a ring is exactly as wide as the bit"}};

}  // namespace

Result<Figures> drillTradeoff(const DrillTradeoffJob& job, const Progress& progress) {
  Stopwatch total;
  if (const auto checked = check(job); !checked) return tl::unexpected(checked.error());
  if (const auto checked = checkMemory(job); !checked) return tl::unexpected(checked.error());
  if (progress) progress("swept volume", 0);
  const auto scene = tradeoff::drillScene(job.scene, job.length_mm);
  if (!scene) return tl::unexpected(scene.error());
  if (progress) progress("phantom", 0);
  auto site = BuildSite::make();
  if (!site) return tl::unexpected(site.error());
  Figures figures = sceneFigures(job, *scene);
  figures["sums_s"] = shortened(site->sumsOver(tradeoff::drillLattice(*scene, job.spacings_mm.front())));
  figures["centres"] = site->centres();

  const auto rows = measureAll(job, *scene, *site, progress);
  if (!rows) return tl::unexpected(rows.error());
  const auto torn = tornBySingle(job);
  if (!torn) return tl::unexpected(torn.error());
  figures["rows"] = Figures::array();
  const std::size_t each = rows->size() / job.spacings_mm.size();
  for (std::size_t n = 0; n < rows->size(); ++n) {
    const DrillMeasured& row = (*rows)[n];
    const bool single = row.precision == drill::Precision::Single;
    figures["rows"].push_back(rowOf(row, (*rows)[n - n % each], single ? (*torn)[n / each] : 0));
  }
  const tradeoff::Wanted wanted{job.rate_hz, job.headroom};
  const auto best = tradeoff::recommended(*rows, wanted);
  if (best) figures["recommended_row"] = *best;
  figures["recommendation"] = adviceOn(*rows, wanted, best);
  if (!job.html.empty()) {
    const auto written = writePage(job.html, drillTradeoffPage(figures));
    if (!written) return tl::unexpected(written.error());
    figures["html"] = job.html;
  }
  figures["total_s"] = total.lap_s();
  return figures;
}

std::span<const TableColumn> drillColumns() { return kColumns; }

std::string drillTradeoffTable(const Figures& figures) {
  std::string out = textTable(kColumns, figures["rows"]);
  const auto number = [&](const char* key) { return shortNumber(figures[key].get<double>()); };
  out += "\nScene " + figures["scene"].get<std::string>() + " over " + number("length_mm") + " mm, " +
         number("cycles") + " cycles, each with its fastest of " + number("repeats") +
         ". Swept: " + number("swept_mm3") + " mm3, known to " + number("swept_error_percent") +
         " %; a cycle's share to " + number("swept_cycle_error_percent") + " %.\n";
  return out + figures["recommendation"].get<std::string>() + "\n";
}

}  // namespace spinaltap::jobs
