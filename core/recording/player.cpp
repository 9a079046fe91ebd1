#include "core/recording/player.h"

#include <algorithm>
#include <utility>

namespace spinaltap::recording {

Result<Player> Player::create(Recording recording) {
  Player player;
  player.recording_ = std::move(recording);
  std::string& engine = player.recording_.header.config.engine;
  const std::string recorded_engine = engine;
  if (engine == "reference") engine = "clearance";
  player.moments_.reserve(player.recording_.inputs.size());
  const auto keep = [&](const session::Input& input, const session::Output& output,
                        std::span<const std::uint32_t> removed) {
    if (output.status != session::Status::Ok) return;
    player.moments_.push_back({input, output.thrust_N, output.depth_mm, output.removed_total});
    player.removed_.insert(player.removed_.end(), removed.begin(), removed.end());
  };
  const Result<ReplayReport> report = replay(player.recording_, {}, keep);
  if (!report) return tl::unexpected(report.error());
  engine = recorded_engine;
  player.report_ = *report;
  player.volume_ = player.recording_.volume;
  return player;
}

void Player::seek(std::uint64_t cycle) {
  const auto gone = [&](std::uint64_t at) { return at == 0 ? 0 : moment(at).removed_total; };
  cycle = std::min(cycle, cycles());
  for (std::uint64_t i = gone(cycle_); i < gone(cycle); ++i) {
    volume_.alive[removed_[i] >> 6] &= ~(1ull << (removed_[i] & 63));
  }
  for (std::uint64_t i = gone(cycle); i < gone(cycle_); ++i) {
    volume_.alive[removed_[i] >> 6] |= 1ull << (removed_[i] & 63);
  }
  cycle_ = cycle;
}

}  // namespace spinaltap::recording
