// server/jobs/drill_job.h - drilling without a screen: scripted scenes or a trace of poses, on a case's path or on the
// bare scene volume; and replay.
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/metrics/metrics.h"
#include "core/recording/recording.h"
#include "core/session/scenes.h"
#include "server/jobs/figures.h"
#include "server/store/store.h"

namespace spinaltap::jobs {

/// What is drilled.
struct DrillSite {
  point_volume::PointVolume volume;
  session::Config config;
  metrics::Plan plan;
  std::optional<Field> field;    ///< the bone's surface, where it is known
  std::string case_id, path_id;  ///< empty for the scene volume
};

/// From now on the path stays as it is (store::Store::findPathToDrill). @error NotFound, Corrupt, Io.
[[nodiscard]] Result<DrillSite> siteOfPath(store::Store& store, const std::string& case_id, const std::string& path_id);
/// The report's volume, all bone. @error never, but for a broken lattice.
[[nodiscard]] Result<DrillSite> siteOfReport();

struct DrillJob {
  std::optional<session::Scene> scene;  ///< without one: the trace
  std::vector<session::Input> trace;
  std::optional<std::uint64_t> cycles;  ///< of a scene: default as many as the path is long; of a trace: at most
  std::string engine = "clearance";
  double speed_rpm = haptics::kSpeed_rpm;
  std::optional<haptics::Coupling> coupling;  ///< none: held rigidly
  /// CSV, whole or not at all; empty: none. A row a cycle: t_us, depth_mm, thrust_N, side_x_N, side_y_N, torque_Nmm,
  /// tip_x_mm, tip_y_mm, tip_z_mm, removed. The tip is the bit's, in the path frame; sides as haptics::Reaction.
  std::filesystem::path forces;
  std::filesystem::path out;  ///< a recording is written here, whole or not at all; empty: none
  bool keep = false;          ///< also keep the recording with the case
};

/// Figures: case_id, path_id (of a case), engine, scene or trace_poses, points, points_alive, discs, cycles, refused,
/// behind, hash, the metrics (core/metrics/metrics.h), step_us_mean, total_s, recording_id (when kept).
/// @param store  may be null when job.keep is false.
/// @error NotFound (engine), Limit (cycles), Io.
[[nodiscard]] Result<Figures> drill(store::Store* store, DrillSite site, const DrillJob& job, const Progress& progress);

/// Figures: verified, cycles, hash, first_difference, discs, comparable, finding, inputs, bytes, format, complete,
/// engine, case_id, path_id, scene, core_version, total_s.
/// @error as recording::read and recording::replay.
[[nodiscard]] Result<Figures> replay(std::span<const std::byte> bytes, const Progress& progress);

/// 16 hex digits.
[[nodiscard]] std::string hex(std::uint64_t hash);

/// Metrics as JSON, in their own order.
[[nodiscard]] Figures figuresOf(const metrics::Metrics& metrics);

}  // namespace spinaltap::jobs
