#include "server/haptic_client/remote_drill.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "server/jobs/drill_job.h"
#include "server/store/blob_store.h"

namespace spinaltap::haptic_client {
namespace {

constexpr double kSlack_s = 10;
constexpr std::chrono::milliseconds kLook{50};

/// Rows of the CSV, as answers come.
class Rows {
 public:
  Rows() { text_.reserve(std::size_t{8} << 20); }
  void add(const Answered& answered) {
    const wire::Feedback& f = answered.answer.feedback;
    // The bone's own newtons: the thrust is told so; what was shortened to the device, with it.
    const double along = -f.force_N.z;
    const double whole = f.limited && along != 0 ? f.thrust_N / along : 1 / answered.force_scale;
    const Vec3 &hand = answered.tick.hand.tip_mm, &felt = answered.tick.felt.force_N;
    std::array<char, 512> row{};
    std::snprintf(row.data(), row.size(),
                  "%llu,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%llu,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%u\n",
                  static_cast<unsigned long long>(f.t_us), f.depth_mm, f.thrust_N, f.force_N.x * whole,
                  f.force_N.y * whole, 0.0 - f.torque_Nmm.z * whole, f.tip_mm.x, f.tip_mm.y, f.tip_mm.z,
                  static_cast<unsigned long long>(f.removed_total - removed_), hand.x, hand.y, hand.z, felt.x, felt.y,
                  felt.z, answered.answer.round_trip_us);
    removed_ = f.removed_total;
    text_ += row.data();
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_ =
      "t_us,depth_mm,thrust_N,side_x_N,side_y_N,torque_Nmm,tip_x_mm,tip_y_mm,tip_z_mm,removed,"
      "hand_x_mm,hand_y_mm,hand_z_mm,felt_x_N,felt_y_N,felt_z_N,round_trip_us\n";
  std::uint64_t removed_ = 0;
};

double quantile(const std::vector<std::uint32_t>& sorted, double share) {
  if (sorted.empty()) return 0;
  const auto at = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::clamp<std::size_t>(at, 1, sorted.size()) - 1];
}

jobs::Figures describe(const RemoteDrill& job, const Client& client, const Outcome& outcome, bool reached) {
  const Tally& tally = outcome.tally;
  const wire::Welcome& welcome = client.welcome();
  const std::vector<std::uint32_t> round_trips = client.roundTrips_us();
  jobs::Figures figures{{"case_id", job.case_id},
                        {"path_id", job.path_id},
                        {"hand", std::string(haptics::nameOf(job.hand.holding))},
                        {"rate_hz", client.traits().rate_hz},
                        {"lockstep", job.pace == Pace::Lockstep},
                        {"server_realtime", welcome.realtime}};
  if (!client.realtimeLine().empty()) figures["realtime"] = client.realtimeLine();
  figures["stiffness_N_mm"] = welcome.stiffness_N_mm;
  figures["force_scale"] = welcome.force_scale;
  figures["poses"] = tally.sent;
  figures["late_ticks"] = tally.late_ticks;
  figures["answered"] = round_trips.size();
  figures["p50_us"] = quantile(round_trips, 0.5);
  figures["p99_us"] = quantile(round_trips, 0.99);
  figures["max_us"] = quantile(round_trips, 1);
  figures["resumed"] = tally.resumed;
  figures["let_go"] = tally.let_go;
  figures["peak_felt_N"] = tally.peak_N;
  figures["mean_felt_N"] = tally.felt_s > 0 ? tally.sum_N_s / tally.felt_s : 0;
  figures["limited"] = tally.limited;
  figures["given_mJ"] = tally.given_mJ;
  figures["most_given_mJ"] = tally.most_given_mJ;
  figures["braked"] = tally.braked;
  figures["depth_mm"] = tally.depth_mm;
  figures["reached"] = reached;
  return figures;
}

}  // namespace

Result<jobs::Figures> drillRemotely(const RemoteDrill& job, const jobs::Progress& progress) {
  jobs::Stopwatch watch;
  ClientSetup setup;
  setup.server = job.server, setup.case_id = job.case_id, setup.path_id = job.path_id;
  setup.pace = job.pace, setup.realtime = job.realtime;
  const auto site = findSite(job.server, job.case_id, job.path_id, setup.patience);
  if (!site) return tl::unexpected(site.error());
  VirtualHand hand = job.hand;
  hand.approach.start_mm = job.start_mm.value_or(-site->lead_mm);
  const double depth_mm = job.depth_mm.value_or(site->length_mm);
  const double way_mm = std::max(0.0, depth_mm - hand.approach.start_mm);
  const double seconds = job.seconds.value_or(kSlack_s + 3 * way_mm / hand.approach.feed_mm_s);

  Rows rows;
  std::atomic<bool> reached = false;
  setup.on_tick = [&](const Tick& tick, double depth) {
    if (depth >= depth_mm && tick.phase == Phase::Holding) reached = true;
    return !reached && 1e-6 * static_cast<double>(tick.t_us) < seconds;
  };
  if (!job.forces.empty()) setup.on_answer = [&](const Answered& answered) { rows.add(answered); };
  VirtualDevice device(hand, job.device);
  auto client = Client::start(setup, device);
  if (!client) return tl::unexpected(client.error());
  while ((*client)->isRunning()) {
    const double done = ((*client)->tally().depth_mm - hand.approach.start_mm) / std::max(way_mm, 1e-9);
    if (progress)
      progress((*client)->isBroken() ? "the line broke, trying again" : "drill", std::clamp(done, 0.0, 1.0));
    std::this_thread::sleep_for(kLook);
  }
  const auto outcome = (*client)->finish();
  if (!outcome) return tl::unexpected(outcome.error());
  if (!outcome->device_error.empty()) return fail(ErrorCode::Io, "device: " + outcome->device_error);
  jobs::Figures figures = describe(job, **client, *outcome, reached);
  const auto metrics = jobs::Figures::parse(outcome->metrics_json, nullptr, false);
  if (metrics.is_object()) figures.update(metrics);
  figures["recording_id"] = outcome->recording_id;
  if (!job.forces.empty()) {
    auto written = store::replaceFile(job.forces, std::as_bytes(std::span(rows.text())));
    if (!written) return tl::unexpected(written.error());
  }
  figures["total_s"] = watch.lap_s();
  return figures;
}

}  // namespace spinaltap::haptic_client
