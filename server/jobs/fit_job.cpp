#include "server/jobs/fit_job.h"

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/base/box.h"
#include "core/base/parallel.h"
#include "core/surface/surface.h"
#include "server/jobs/words.h"
#include "server/store/blob_store.h"

namespace spinaltap::jobs {
namespace {

constexpr std::size_t kMostRows = 20'000'000;
constexpr double kEvaluateShare = 0.01;  // of the fit's tolerance

using Row = std::array<double, 6>;

/// The numbers of a line; how many there are.
Result<std::size_t> parseRow(std::string_view line, Row& row) {
  std::size_t count = 0;
  for (std::string_view word = nextWord(line); !word.empty(); word = nextWord(line)) {
    if (count == row.size()) return fail(ErrorCode::Corrupt, "more than 6 numbers");
    const auto number = numberIn(word);
    if (!number) return fail(ErrorCode::Corrupt, "not a number: '" + std::string(word.substr(0, 24)) + "'");
    if (!std::isfinite(*number))
      return fail(ErrorCode::NotFinite, "number " + std::to_string(count + 1) + " is not finite");
    row[count++] = *number;
  }
  return count;
}

/// All rows have as many columns as the first one, which `allowed` says whether it may have.
template <class Allowed, class Use>
Result<void> eachRow(std::string_view text, std::string_view name, const char* wanted, const Allowed& allowed,
                     const Use& use) {
  std::size_t columns = 0, rows = 0;
  auto read = eachLine(text, name, [&](std::string_view line) -> Result<void> {
    Row row{};
    const auto count = parseRow(line, row);
    if (!count) return tl::unexpected(count.error());
    if (columns == 0) columns = *count;
    if (!allowed(columns) || *count != columns) {
      return fail(ErrorCode::Corrupt, std::to_string(*count) + " numbers; each line needs " + wanted);
    }
    if (++rows > kMostRows) return fail(ErrorCode::Limit, "over 20 million rows");
    use(row, columns);
    return {};
  });
  if (!read) return read;
  if (rows == 0) return fail(ErrorCode::Corrupt, std::string(name) + ": no points");
  return {};
}

/// As on a surface: the box's diagonal over the root of how many there are.
double usualSpacing(const std::vector<Vec3>& points) {
  const auto [low, high] = boxAround(points);
  return norm(high - low) / std::sqrt(static_cast<double>(points.size()));
}

Result<rbf::Samples> fromNormals(surface::OrientedPoints points, std::string_view name,
                                 std::optional<double> offset_mm) {
  for (Vec3& n : points.normals) {
    if (!(norm(n) > 0)) return fail(ErrorCode::Degenerate, std::string(name) + ": a normal has no length");
    n = normalized(n);
  }
  auto made = surface::makeSamples(points, offset_mm.value_or(usualSpacing(points.positions_patient)));
  if (!made) return fail(made.error().code, std::string(name) + ": " + made.error().message);
  return rbf::Samples{std::move(made->positions), std::move(made->distances_mm)};
}

Result<std::vector<Vec3>> parsePoints(std::string_view text, std::string_view name) {
  std::vector<Vec3> out;
  const auto read = eachRow(
      text, name, "3: x y z", [](std::size_t columns) { return columns == 3; },
      [&](const Row& r, std::size_t) { out.push_back({r[0], r[1], r[2]}); });
  if (!read) return tl::unexpected(read.error());
  return out;
}

Result<std::string> readText(const std::filesystem::path& file) {
  const auto bytes = store::readFile(file);
  if (!bytes) return tl::unexpected(bytes.error());
  return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

void append(std::string& text, double number, char end) {
  std::array<char, 32> digits{};
  const auto written =
      std::to_chars(digits.data(), digits.data() + digits.size(), number);  // reads back to the same bits
  text.append(digits.data(), written.ptr);
  text.push_back(end);
}

double peakRss_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

Result<void> evaluateAt(const FitJob& job, const rbf::Model& model, Figures& figures, Stopwatch& watch) {
  const auto text = readText(job.points);
  if (!text) return tl::unexpected(text.error());
  const auto points = parsePoints(*text, job.points.filename().string());
  if (!points) return tl::unexpected(points.error());
  const double tolerance =
      job.evaluate_tolerance_mm > 0 ? job.evaluate_tolerance_mm : kEvaluateShare * job.options.tolerance_mm;
  std::vector<double> values(points->size());
  std::vector<Vec3> slopes(job.gradients ? points->size() : 0);
  (void)watch.lap_s();
  const rbf::Evaluator evaluator(model, tolerance, job.options.threads);
  evaluator.values(*points, values);
  if (job.gradients) evaluator.gradients(*points, slopes);
  const double evaluate_s = watch.lap_s();
  std::string out;
  for (std::size_t i = 0; i < values.size(); ++i) {
    append(out, values[i], job.gradients ? ' ' : '\n');
    if (!job.gradients) continue;
    append(out, slopes[i].x, ' '), append(out, slopes[i].y, ' '), append(out, slopes[i].z, '\n');
  }
  std::filesystem::path file = job.values;
  if (file.empty()) file = job.points, file += ".values";
  auto written = store::replaceFile(file, std::as_bytes(std::span(out)));
  if (!written) return written;
  figures["points"] = values.size();
  figures["evaluate_s"] = evaluate_s;
  figures["points_per_s"] = static_cast<double>(values.size()) / std::max(evaluate_s, 1e-9);
  figures["evaluate_tolerance_mm"] = tolerance;
  figures["values_file"] = file.filename().string();
  return {};
}

}  // namespace

Result<rbf::Samples> parseSamples(std::string_view text, std::string_view name, std::optional<double> offset_mm) {
  rbf::Samples samples;
  surface::OrientedPoints oriented;
  const auto read = eachRow(
      text, name, "4 (x y z value) or 6 (x y z and a normal), all the same",
      [](std::size_t columns) { return columns == 4 || columns == 6; },
      [&](const Row& r, std::size_t columns) {
        if (columns == 4) {
          samples.positions.push_back({r[0], r[1], r[2]}), samples.distances_mm.push_back(r[3]);
        } else {
          oriented.positions_patient.push_back({r[0], r[1], r[2]}), oriented.normals.push_back({r[3], r[4], r[5]});
        }
      });
  if (!read) return tl::unexpected(read.error());
  if (!oriented.normals.empty()) return fromNormals(std::move(oriented), name, offset_mm);
  return samples;
}

Result<Figures> fitPoints(const FitJob& job, const Progress& progress) {
  Stopwatch total, watch;
  const auto text = readText(job.samples);
  if (!text) return tl::unexpected(text.error());
  const auto samples = parseSamples(*text, job.samples.filename().string(), job.offset_mm);
  if (!samples) return tl::unexpected(samples.error());
  const double read_s = watch.lap_s();
  const auto fit = rbf::fit(*samples, job.options, [&](double fraction) {
    if (progress) progress("fit", fraction);
  });
  if (!fit) return tl::unexpected(fit.error());
  const double fit_s = watch.lap_s();
  const rbf::FitReport& r = fit->report;
  Figures figures{{"samples", r.samples},
                  {"merged", r.merged},
                  {"centres", r.centres},
                  {"rounds", r.rounds},
                  {"threads", threadsOr(job.options.threads)},
                  {"tolerance_mm", job.options.tolerance_mm},
                  {"smoothing_mm", r.smoothing},
                  {"residual_max_mm", r.residual_max_mm},
                  {"residual_rms_mm", r.residual_rms_mm},
                  {"residual_samples", r.residual_samples},
                  {"reduction_max_mm", r.reduction_max_mm},
                  {"sum_abs_weights", r.sum_abs_weights},
                  {"read_s", read_s},
                  {"fit_s", fit_s}};
  if (job.options.smoothing == rbf::kAutoSmoothing) figures["noise_mm"] = r.noise_mm;
  if (!job.points.empty()) {
    if (const auto done = evaluateAt(job, fit->model, figures, watch); !done) return tl::unexpected(done.error());
  }
  figures["peak_rss_mb"] = peakRss_mb();
  figures["total_s"] = total.lap_s();
  return figures;
}

}  // namespace spinaltap::jobs
