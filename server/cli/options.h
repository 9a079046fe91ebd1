// server/cli/options.h - what the user asked for, one struct a subcommand.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/vec3.h"
#include "core/haptics/holding.h"
#include "core/plan/path.h"
#include "core/surface/defaults.h"
#include "server/jobs/drill_tradeoff_job.h"
#include "server/jobs/haptic_tradeoff_job.h"
#include "server/jobs/plan_job.h"

namespace spinaltap::cli {

struct PhantomOptions {
  std::string out;
  bool osteoporotic = false;
  std::uint64_t seed = 1;
  int reduce = 1;  ///< voxels this many times wider: quick small stacks for tests
};

struct ImportOptions {
  std::string data, from, label_file, name;
  int label_value = 1, series = 0;
};

struct SegmentOptions {
  std::string data, case_id, seed;
  std::optional<double> threshold_HU;
  bool grow = false;
};

struct ReconstructOptions {
  std::string data, case_id;
  std::string method = "subvoxel";
  double tolerance_mm = surface::kFitTolerance_mm;
  std::optional<double> sample_spacing_mm, smoothing_mm;
  double cell_mm = surface::kCell_mm;
};

struct ExportOptions {
  std::string data, case_id, format, out;
  std::optional<double> simplify_mm;
};

struct FitOptions {
  std::string file, points, values, smoothing = "0";
  double tolerance_mm = 0.01, reduce_mm = 0, evaluate_tolerance_mm = 0;
  std::optional<double> offset_mm;
  unsigned threads = 0;
  bool gradients = false;
};

struct TradeoffOptions {
  std::string data, case_id, out;
  bool surface = false, osteoporotic = false;
  std::vector<std::string> methods, smoothings;
  double sample_spacing_mm = 0;  ///< 0: as reconstruct chooses
  int reduce = 1;
  std::string scene = "hand";  ///< of the drill, as what follows
  bool full = false;
  jobs::DrillTradeoffJob drill;
  bool haptics = false;
  jobs::HapticTradeoffJob hands;
  std::string html;  ///< of the drill or the hands
};

struct PlanOptions {
  std::string data, case_id, label, entry, target;
  plan::Bit bit;
  double radius_mm = 4, spacing_mm = 0.1, lead_mm = jobs::kLead_mm;
};

struct DrillOptions {
  std::string data, case_id, path_id, volume, scene, trace, engine = "clearance", out, forces;
  std::optional<std::uint64_t> cycles;
  std::optional<double> stiffness_N_mm;  ///< none: held rigidly
  double speed_rpm = session::Config{}.speed_rpm;
  bool no_store = false;
  std::string server, hand = "tense";  ///< a simulated hand on a server that runs; as what follows
  double rate_hz = 1000, feed_mm_s = haptics::Approach{}.feed_mm_s, max_force_N = 0, damping_N_s_mm = 0;
  std::optional<double> start_mm, depth_mm, seconds;
  bool lockstep = false, realtime = false;
};

struct ReplayOptions {
  std::string data, file;
};

struct ServeOptions {
  std::string data, address = "127.0.0.1", web;
  std::vector<std::string> hosts;
  std::uint16_t port = 8080;
  bool realtime = false;
};

struct LoadOptions {
  int sessions = 64;
  double rate_hz = 1000, seconds = 10;
  std::string server, case_id, path_id;
  bool rigid = false, realtime = false;
};

struct CasesOptions {
  std::string data;
};

}  // namespace spinaltap::cli
