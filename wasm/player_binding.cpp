#include <emscripten/bind.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/recording/player.h"
#include "wasm/binding_help.h"
#include "wasm/session_binding.h"

namespace spinaltap::wasm {
namespace {

using emscripten::val;

val tripleOf(const Vec3& v) {
  val array = val::array();
  array.call<void>("push", v.x, v.y, v.z);
  return array;
}

class PlayerBinding {
 public:
  explicit PlayerBinding(recording::Player player) : player_(std::move(player)) {}

  [[nodiscard]] double cycles() const { return static_cast<double>(player_.cycles()); }
  void seek(double cycle) { player_.seek(wholeOf(cycle)); }
  [[nodiscard]] double cycle() const { return static_cast<double>(player_.cycle()); }

  [[nodiscard]] std::string headerJson() const {
    const recording::Header& header = player_.header();
    const point_volume::Lattice& lattice = player_.before().lattice;
    val bit = val::object(), grid = val::object(), all = val::object();
    bit.set("diameter_mm", header.config.bit.diameter_mm);
    bit.set("cone_length_mm", header.config.bit.cone_length_mm);
    bit.set("length_mm", header.config.bit.length_mm);
    grid.set("spacing_mm", lattice.spacing_mm);
    grid.set("rings", lattice.rings);
    grid.set("discs", lattice.discs);
    grid.set("first_disc", lattice.first_disc);
    all.set("core_version", header.core_version);
    all.set("case_id", header.case_id);
    all.set("path_id", header.path_id);
    all.set("scene", header.scene);
    all.set("engine", header.config.engine);
    all.set("bit", bit);
    all.set("speed_rpm", header.config.speed_rpm);
    all.set("stiffness_N_mm", header.config.coupling ? header.config.coupling->stiffness_N_mm : 0.0);
    all.set("lattice", grid);
    all.set("points", static_cast<double>(lattice.points()));
    all.set("points_alive", static_cast<double>(countAlive(player_.before())));
    all.set("cycles", cycles());
    all.set("complete", player_.complete());
    return val::global("JSON").call<std::string>("stringify", all);
  }

  /// Cycle 0 is before the first: its pose, and nothing cut yet. An empty recording has no pose: undefined.
  [[nodiscard]] val poseAt(double cycle) const {
    if (player_.cycles() == 0) return val::undefined();
    const std::uint64_t at = std::min(wholeOf(cycle), player_.cycles());
    const recording::Moment moment = player_.moment(std::max<std::uint64_t>(at, 1));
    val pose = val::object();
    pose.set("t_us", static_cast<double>(moment.input.t_us));
    pose.set("tip", tripleOf(moment.bit.tip_mm));
    pose.set("axis", tripleOf(moment.bit.axis));
    pose.set("spinning", moment.input.spinning);
    pose.set("depth_mm", moment.depth_mm);
    pose.set("thrust_N", at == 0 ? 0.0 : moment.thrust_N);
    pose.set("removed_total", at == 0 ? 0.0 : static_cast<double>(moment.removed_total));
    return pose;
  }

  /// Rows of t_s, depth_mm, thrust_N, removed_mm3: every `stride`-th cycle, and the last.
  [[nodiscard]] val series(double stride) const {
    const std::uint64_t step = std::max<std::uint64_t>(wholeOf(stride), 1), last = player_.cycles();
    const double point_mm3 = pointVolume_mm3(player_.before().lattice);
    std::vector<float> rows;
    for (std::uint64_t cycle = 1; cycle <= last; cycle = cycle < last ? std::min(cycle + step, last) : last + 1) {
      const recording::Moment moment = player_.moment(cycle);
      const double t_s = static_cast<double>(moment.input.t_us - player_.moment(1).input.t_us) * 1e-6;
      for (const double v :
           {t_s, moment.depth_mm, moment.thrust_N, static_cast<double>(moment.removed_total) * point_mm3}) {
        rows.push_back(static_cast<float>(v));
      }
    }
    return arrayOf("Float32Array", rows);
  }

  [[nodiscard]] val splats() const { return floatsOf(splats::scan(player_.volume(), player_.before())); }

  [[nodiscard]] val aliveBits() const { return aliveBitsOf(player_.volume()); }

  [[nodiscard]] val verify() const {
    const recording::ReplayReport& report = player_.report();
    val result = val::object();
    result.set("verified", report.verified);
    result.set("cycles", static_cast<double>(report.cycles));
    result.set("hash", hexOf(report.state_hash));
    result.set("first_difference", static_cast<double>(report.first_difference));
    val discs = val::array();
    for (const std::uint32_t disc : report.discs) discs.call<void>("push", disc);
    result.set("discs", discs);
    result.set("comparable", report.comparable);
    result.set("finding", recording::describe(report));
    return result;
  }

 private:
  recording::Player player_;
};

Result<std::unique_ptr<PlayerBinding>> fromBytes(const val& array) {
  const Result<std::vector<std::byte>> bytes = bytesOf(array, "recording");
  if (!bytes) return tl::unexpected(bytes.error());
  Result<recording::Recording> recording = recording::read(*bytes);
  if (!recording) return tl::unexpected(recording.error());
  Result<recording::Player> player = recording::Player::create(std::move(*recording));
  if (!player) return tl::unexpected(player.error());
  return std::make_unique<PlayerBinding>(std::move(*player));
}

PlayerBinding* make(const val& array) { return orNull(fromBytes(array)); }

}  // namespace

void bindPlayer() {
  emscripten::function("makePlayer", &make, emscripten::allow_raw_pointers());
  emscripten::class_<PlayerBinding>("RecordingPlayer")
      .function("cycles", &PlayerBinding::cycles)
      .function("headerJson", &PlayerBinding::headerJson)
      .function("seek", &PlayerBinding::seek)
      .function("cycle", &PlayerBinding::cycle)
      .function("poseAt", &PlayerBinding::poseAt)
      .function("series", &PlayerBinding::series)
      .function("splats", &PlayerBinding::splats)
      .function("aliveBits", &PlayerBinding::aliveBits)
      .function("verify", &PlayerBinding::verify);
}

}  // namespace spinaltap::wasm
