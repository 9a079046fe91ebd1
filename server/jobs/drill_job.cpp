#include "server/jobs/drill_job.h"

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "server/jobs/case_files.h"

namespace spinaltap::jobs {
namespace {

/// The recording in memory: drills of the command line are short, and a file appears whole or not at all.
class Kept {
 public:
  Result<void> begin(const recording::Header& header, const point_volume::PointVolume& volume) {
    auto writer = recording::Writer::begin(header, volume, [bytes = bytes_](std::span<const std::byte> more) {
      bytes->insert(bytes->end(), more.begin(), more.end());
      return true;
    });
    if (!writer) return tl::unexpected(writer.error());
    writer_.emplace(std::move(*writer));
    return {};
  }
  Result<void> append(const session::Input& input, const session::Output& output,
                      std::span<const std::uint32_t> removed, const point_volume::PointVolume& volume) {
    return writer_ ? writer_->append(input, output, removed, volume) : Result<void>{};
  }
  Result<void> finish() { return writer_ ? writer_->finish() : Result<void>{}; }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return *bytes_; }

 private:
  std::shared_ptr<std::vector<std::byte>> bytes_ = std::make_shared<std::vector<std::byte>>();
  std::optional<recording::Writer> writer_;
};

struct Run {
  std::uint64_t cycles = 0, refused = 0, inputs = 0, hash = 0;
  bool behind = false;
  double step_s = 0;
};

std::uint64_t inputsOf(const DrillJob& job, double start_z_mm, double length_mm) {
  if (!job.scene) return std::min<std::uint64_t>(job.cycles.value_or(job.trace.size()), job.trace.size());
  return job.cycles.value_or(session::sceneCycles(*job.scene, length_mm - start_z_mm));
}

constexpr const char* kForceColumns =
    "t_us,depth_mm,thrust_N,side_x_N,side_y_N,torque_Nmm,tip_x_mm,tip_y_mm,tip_z_mm,removed\n";

std::string forceRow(std::uint64_t t_us, const session::Output& output) {
  std::array<char, 256> row{};
  const Vec3 &force = output.force_N, &tip = output.bit.tip_mm;
  std::snprintf(row.data(), row.size(), "%llu,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%llu\n",
                static_cast<unsigned long long>(t_us), output.depth_mm, output.thrust_N, force.x, force.y,
                0.0 - output.torque_Nmm.z, tip.x, tip.y, tip.z, static_cast<unsigned long long>(output.removed));
  return row.data();
}

Result<Run> run(session::Session& session, const DrillJob& job, std::uint64_t inputs, double start_z_mm, Kept& kept,
                metrics::Accumulator& accumulator, std::string* forces, const Progress& progress) {
  Run result;
  std::vector<std::uint32_t> removed;
  for (std::uint64_t i = 0; i < inputs; ++i) {
    const session::Input input =
        job.scene ? session::sceneInput(*job.scene, i, start_z_mm) : job.trace[static_cast<std::size_t>(i)];
    Stopwatch watch;
    removed.clear();
    const session::Output output = session.step(
        input, [&](std::span<const std::uint32_t> some) { removed.insert(removed.end(), some.begin(), some.end()); });
    result.step_s += watch.lap_s();
    if (const auto appended = kept.append(input, output, removed, session.volume()); !appended) {
      return tl::unexpected(appended.error());
    }
    if (output.status == session::Status::Ok) {
      accumulator.add({input.t_us, output.bit.tip_mm, output.bit.axis, input.spinning, output.thrust_N, removed});
      result.cycles = output.cycle;
      result.behind = output.behind;
      if (forces != nullptr) *forces += forceRow(input.t_us, output);
    } else {
      ++result.refused;
    }
    if (progress && i % 256 == 0) progress("drill", static_cast<double>(i) / static_cast<double>(inputs));
  }
  result.inputs = inputs;
  result.hash = session.stateHash();
  return result;
}

Figures describeRun(const DrillSite& site, const DrillJob& job, const point_volume::Lattice& lattice,
                    std::uint64_t alive, const Run& run) {
  Figures figures = Figures::object();
  if (!site.case_id.empty()) figures["case_id"] = site.case_id, figures["path_id"] = site.path_id;
  figures["engine"] = job.engine;
  if (job.scene) figures["scene"] = session::nameOf(*job.scene);
  if (!job.scene) figures["trace_poses"] = job.trace.size();
  figures["points"] = lattice.points();
  figures["points_alive"] = alive;
  figures["discs"] = lattice.discs;
  figures["cycles"] = run.cycles;
  figures["refused"] = run.refused;
  figures["behind"] = run.behind;
  figures["hash"] = hex(run.hash);
  return figures;
}

Result<void> store(store::Store* where, const DrillSite& site, const DrillJob& job, const Kept& kept,
                   const std::string& forces, const metrics::Metrics& metrics, Figures& figures) {
  if (!job.out.empty()) {
    if (const auto written = store::replaceFile(job.out, kept.bytes()); !written) return written;
  }
  if (!job.forces.empty()) {
    if (const auto written = store::replaceFile(job.forces, std::as_bytes(std::span(forces))); !written) return written;
  }
  if (!job.keep) return {};
  const auto blob = where->blobs().put(kept.bytes());
  if (!blob) return tl::unexpected(blob.error());
  const auto row = where->addRecording({"", site.case_id, site.path_id, "", figures["cycles"].get<std::uint64_t>(),
                                        true, figuresOf(metrics).dump(), *blob});
  if (!row) return tl::unexpected(row.error());
  figures["recording_id"] = row->id;
  return {};
}

}  // namespace

std::string hex(std::uint64_t hash) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(hash));
  return text.data();
}

Figures figuresOf(const metrics::Metrics& metrics) {
  Figures figures = Figures::object();
  for (const auto& [key, value] : metrics::named(metrics)) {
    std::visit([&figures, &name = key](const auto& v) { figures[name] = v; }, value);
  }
  // counts are whole numbers in JSON too
  for (const char* key : {"cycles", "removed"}) {
    if (figures.contains(key)) figures[key] = static_cast<std::uint64_t>(figures[key].get<double>());
  }
  return figures;
}

Result<DrillSite> siteOfPath(store::Store& store, const std::string& case_id, const std::string& path_id) {
  const auto row = store.findCase(case_id);
  if (!row) return tl::unexpected(row.error());
  const auto path = store.findPathToDrill(case_id, path_id);
  if (!path) return tl::unexpected(path.error());
  auto volume = loadPointVolume(store, *path);
  if (!volume) return tl::unexpected(volume.error());
  const auto model = loadModel(store, *row);
  if (!model) return tl::unexpected(model.error());
  DrillSite site{
      std::move(*volume), session::Config{path->path.bit}, metrics::planOf(path->path), {}, case_id, path_id};
  site.field = rbf::asField(*model, lipschitzOf(*model));
  return site;
}

Result<DrillSite> siteOfReport() {
  auto volume = session::sceneVolume();
  if (!volume) return tl::unexpected(volume.error());
  metrics::Plan plan{session::reportBit(), session::kReportLength_mm, volume->lattice, {}};
  return DrillSite{std::move(*volume), session::Config{session::reportBit()}, plan, {}, "", ""};
}

Result<Figures> drill(store::Store* where, DrillSite site, const DrillJob& job, const Progress& progress) {
  Stopwatch watch;
  site.config.engine = job.engine;
  site.config.speed_rpm = job.speed_rpm;
  site.config.coupling = job.coupling;
  const point_volume::Lattice lattice = site.volume.lattice;
  const std::uint64_t alive = point_volume::countAlive(site.volume);
  const double start_z_mm = site.case_id.empty() ? 0 : lattice.discZ_mm(0);
  const std::uint64_t inputs = inputsOf(job, start_z_mm, site.plan.length_mm);
  if (job.scene && inputs > session::kMostSceneCycles) {
    return fail(ErrorCode::Limit, "over " + std::to_string(session::kMostSceneCycles) + " cycles");
  }
  Kept kept;
  if (job.keep || !job.out.empty()) {
    const std::string scene = job.scene && site.case_id.empty() ? std::string(session::nameOf(*job.scene)) : "";
    const recording::Header header{SPINALTAP_VERSION, site.case_id, site.path_id, scene, site.config};
    if (const auto begun = kept.begin(header, site.volume); !begun) return tl::unexpected(begun.error());
  }
  auto session = session::Session::create(std::move(site.volume), site.config);
  if (!session) return tl::unexpected(session.error());
  metrics::Accumulator accumulator(site.plan);
  std::string forces = kForceColumns;
  const auto result =
      run(*session, job, inputs, start_z_mm, kept, accumulator, job.forces.empty() ? nullptr : &forces, progress);
  if (!result) return tl::unexpected(result.error());
  if (const auto finished = kept.finish(); !finished) return tl::unexpected(finished.error());

  const metrics::Metrics metrics = accumulator.finish(site.field ? &*site.field : nullptr);
  Figures figures = describeRun(site, job, lattice, alive, *result);
  figures.update(figuresOf(metrics));
  figures["step_us_mean"] = result->inputs == 0 ? 0 : 1e6 * result->step_s / static_cast<double>(result->inputs);
  if (const auto stored = store(where, site, job, kept, forces, metrics, figures); !stored) {
    return tl::unexpected(stored.error());
  }
  figures["total_s"] = watch.lap_s();
  return figures;
}

Result<Figures> replay(std::span<const std::byte> bytes, const Progress& progress) {
  Stopwatch watch;
  const auto read = recording::read(bytes);
  if (!read) return tl::unexpected(read.error());
  const auto report = recording::replay(*read, [&](double fraction) {
    if (progress) progress("replay", fraction);
  });
  if (!report) return tl::unexpected(report.error());
  return Figures{{"verified", report->verified},    {"cycles", report->cycles},
                 {"hash", hex(report->state_hash)}, {"first_difference", report->first_difference},
                 {"discs", report->discs},          {"comparable", report->comparable},
                 {"finding", describe(*report)},    {"inputs", read->inputs.size()},
                 {"bytes", bytes.size()},           {"format", read->version},
                 {"complete", read->complete},      {"engine", read->header.config.engine},
                 {"case_id", read->header.case_id}, {"path_id", read->header.path_id},
                 {"scene", read->header.scene},     {"core_version", read->header.core_version},
                 {"total_s", watch.lap_s()}};
}

}  // namespace spinaltap::jobs
