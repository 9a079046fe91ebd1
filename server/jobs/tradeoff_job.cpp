#include "server/jobs/tradeoff_job.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>

#include "server/jobs/case_files.h"
#include "server/jobs/tradeoff_plots.h"
#include "server/jobs/words.h"

namespace spinaltap::jobs {
namespace {

namespace fs = std::filesystem;
using tradeoff::Measured;

constexpr double kTolerance_mm = 0.01;

Result<tradeoff::Scene> sceneOf(store::Store* store, const TradeoffJob& job, const Progress& progress) {
  if (job.case_id.empty()) {
    phantom::PhantomOptions options;
    options.osteoporotic = job.osteoporotic;
    return tradeoff::phantomScene(options, phantom::CtOptions::coarser(job.reduce), [&](double part) {
      if (progress) progress("phantom", part);
    });
  }
  if (store == nullptr) return fail(ErrorCode::InvalidArgument, "a case needs its data folder");
  const auto row = store->findCase(job.case_id);
  if (!row) return tl::unexpected(row.error());
  auto region = loadRegion(*store, *row);
  if (!region) return tl::unexpected(region.error());
  return tradeoff::caseScene(std::move(region->ct), std::move(region->label));
}

std::vector<tradeoff::Setting> settingsOf(const TradeoffJob& job) {
  std::vector<tradeoff::Setting> all = tradeoff::usualSettings();
  if (!job.smoothings.empty()) {
    all.clear();
    for (const surface::Method method : {surface::Method::Pixel, surface::Method::Normal, surface::Method::Subvoxel})
      for (const double smoothing : job.smoothings) all.push_back({method, kTolerance_mm, smoothing, 0});
  }
  if (job.methods.empty()) return all;
  all.erase(std::remove_if(all.begin(), all.end(),
                           [&](const tradeoff::Setting& s) {
                             return std::count(job.methods.begin(), job.methods.end(), s.method) == 0;
                           }),
            all.end());
  return all;
}

Figures distancesOf(const tradeoff::Distances& d) {
  return {{"mean", shortened(d.mean_mm)}, {"rms", shortened(d.rms_mm)},  {"p95", shortened(d.p95_mm)},
          {"p99", shortened(d.p99_mm)},   {"max", shortened(d.most_mm)}, {"points", d.count}};
}

Figures rowOf(const Measured& m, bool truth_known) {
  Figures row{{"method", std::string(surface::nameOf(m.setting.method))},
              {"tolerance_mm", m.setting.tolerance_mm},
              {"smoothing_mm", m.setting.smoothing < 0 ? Figures("auto") : Figures(m.setting.smoothing)},
              {"reduce_mm", m.setting.reduce_mm},
              {"sample_s", shortened(m.sample_s)},
              {"fit_s", shortened(m.fit_s)}};
  if (!m.fault.empty()) {
    row["fault"] = m.fault;
    return row;
  }
  row["mesh_s"] = shortened(m.mesh_s);
  row["samples"] = m.samples;
  row["centres"] = m.centres;
  row["smoothing_used_mm"] = shortened(m.smoothing);
  row["noise_mm"] = shortened(m.noise_mm);
  row["residual_rms_mm"] = shortened(m.residual_rms_mm);
  row["residual_max_mm"] = shortened(m.residual_max_mm);
  row["points_per_s"] = std::round(m.points_per_s);
  row["distance_mm"] = distancesOf(m.surface);
  if (truth_known) {
    row["missed_mm"] = distancesOf(m.missed);
    row["sides"] = {{"asked", m.sides.asked}, {"wrong", m.sides.wrong}};
  }
  row["volume_mm3"] = shortened(m.volume_mm3);
  row["volume_change_percent"] = shortened(m.volume_change_percent);
  row["roughness_mm"] = shortened(m.roughness_mm);
  row["triangles"] = m.triangles;
  return row;
}

Result<Figures> writePictures(const std::string& folder, const std::vector<Picture>& pictures) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return fail(ErrorCode::Io, "cannot make the folder for the pictures: " + error.message());
  Figures files = Figures::array();
  for (const Picture& p : pictures) {
    const auto written = store::replaceFile(fs::path(folder) / p.file_name, std::as_bytes(std::span(p.svg)));
    if (!written) return tl::unexpected(written.error());
    files.push_back(p.file_name);
  }
  return files;
}

std::string cell(const Figures& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.4g", value.get<double>());
    return text.data();
  }
  return value.dump();
}

}  // namespace

Result<Figures> surfaceTradeoff(store::Store* store, const TradeoffJob& job, const Progress& progress) {
  Stopwatch total;
  const auto scene = sceneOf(store, job, progress);
  if (!scene) return tl::unexpected(scene.error());
  const Vec3& s = scene->ct.grid.spacing_mm;
  tradeoff::RunOptions options;
  options.sample_spacing_mm = job.sample_spacing_mm > 0 ? job.sample_spacing_mm : surface::sampleSpacingFor(s);
  Stopwatch since_start;
  double now_s = 0;
  options.clock = [&] { return now_s += since_start.lap_s(); };

  const bool truth_known = scene->truth.has_value();
  std::vector<View> views = job.out.empty() ? std::vector<View>() : viewsOf(*scene);
  std::vector<Measured> rows;
  const auto settings = settingsOf(job);
  for (std::size_t n = 0; n < settings.size(); ++n) {
    const auto share = [&](double part) {
      if (progress) progress("fits", (static_cast<double>(n) + part) / static_cast<double>(settings.size()));
    };
    const auto run = tradeoff::runSetting(*scene, settings[n], options, share);
    if (!run) return tl::unexpected(run.error());
    rows.push_back(run->measured);
    addOutlines(*run, views);
  }
  Figures figures{
      {"scene", job.case_id.empty() ? (job.osteoporotic ? "phantom, osteoporotic" : "phantom") : job.case_id},
      {"spacing_mm", {s.x, s.y, s.z}},
      {"true_mm3", shortened(scene->true_mm3)},
      {"rows", Figures::array()}};
  for (const Measured& m : rows) figures["rows"].push_back(rowOf(m, truth_known));
  if (!job.out.empty()) {
    auto files = writePictures(job.out, picturesOf(rows, views, truth_known));
    if (!files) return tl::unexpected(files.error());
    figures["files"] = std::move(*files);
  }
  figures["total_s"] = total.lap_s();
  return figures;
}

std::string tradeoffTable(const Figures& figures) {
  static const std::array<std::array<const char*, 3>, 12> kColumns{{{"method", "method", ""},
                                                                    {"tol. mm", "tolerance_mm", ""},
                                                                    {"smooth", "smoothing_mm", ""},
                                                                    {"reduce", "reduce_mm", ""},
                                                                    {"centres", "centres", ""},
                                                                    {"fit s", "fit_s", ""},
                                                                    {"points/s", "points_per_s", ""},
                                                                    {"RMS mm", "distance_mm", "rms"},
                                                                    {"99 % mm", "distance_mm", "p99"},
                                                                    {"volume %", "volume_change_percent", ""},
                                                                    {"rough mm", "roughness_mm", ""},
                                                                    {"triangles", "triangles", ""}}};
  std::string out;
  const auto put = [&](std::string text, bool first) {
    constexpr std::size_t kWide = 10;
    if (text.size() < kWide) text.insert(first ? text.size() : 0, kWide - text.size(), ' ');
    out += text;
  };
  for (const auto& column : kColumns) put(column[0], &column == &kColumns.front());
  out += '\n';
  for (const auto& row : figures["rows"]) {
    for (const auto& column : kColumns) {
      std::string text = row.contains("fault") ? "" : "-";
      if (row.contains(column[1])) text = cell(column[2][0] != 0 ? row[column[1]][column[2]] : row[column[1]]);
      put(text, &column == &kColumns.front());
    }
    if (row.contains("fault")) out += "  " + row["fault"].get<std::string>();
    out += '\n';
  }
  return out;
}

}  // namespace spinaltap::jobs
