#include "core/recording/player.h"

#include <algorithm>
#include <utility>

namespace spinaltap::recording {
namespace {

/// Below that many points a keyframe saves nothing.
constexpr std::uint64_t kLeastApart = 256;

void setAlive(std::span<const std::uint32_t> points, bool alive, std::vector<std::uint64_t>& words) {
  for (const std::uint32_t point : points) {
    const std::uint64_t bit = 1ull << (point & 63);
    words[point >> 6] = alive ? words[point >> 6] | bit : words[point >> 6] & ~bit;
  }
}

}  // namespace

Result<Player> Player::create(Recording recording) {
  Player player;
  player.recording_ = std::move(recording);
  std::string& engine = player.recording_.header.config.engine;
  const std::string recorded_engine = engine;
  if (engine == "reference") engine = "clearance";
  player.thrust_N_.reserve(player.recording_.inputs.size());
  player.gone_.reserve(player.recording_.inputs.size());
  const bool coupled = player.recording_.header.config.coupling.has_value();
  if (coupled) player.bits_.reserve(player.recording_.inputs.size());
  const auto keep = [&](const session::Input&, const session::Output& output, std::span<const std::uint32_t> removed) {
    if (output.status != session::Status::Ok) {
      player.refused_.push_back(output.cycle);
      return;
    }
    player.thrust_N_.push_back(output.thrust_N);
    if (coupled) player.bits_.push_back(output.bit);
    player.removed_.insert(player.removed_.end(), removed.begin(), removed.end());
    player.gone_.push_back(static_cast<std::uint32_t>(player.removed_.size()));
  };
  Result<ReplayReport> report = replay(player.recording_, {}, keep);
  if (!report) return tl::unexpected(report.error());
  engine = recorded_engine;
  player.report_ = std::move(*report);
  player.removed_.shrink_to_fit();
  player.refused_.shrink_to_fit();
  // The inputs stay; what they were compared with has done its work.
  player.recording_.checks = {};
  player.recording_.checkpoints = {};
  player.makeKeyframes();
  return player;
}

void Player::makeKeyframes() {
  volume_ = recording_.volume;
  apart_ = std::max(volume_.lattice.points() / kKeyframes, kLeastApart);
  const std::span<const std::uint32_t> all(removed_);
  for (std::uint64_t begin = 0; begin + apart_ <= all.size(); begin += apart_) {
    setAlive(all.subspan(begin, apart_), false, volume_.alive);
    keyframes_.push_back(volume_.alive);
  }
  volume_.alive = recording_.volume.alive;
}

Moment Player::moment(std::uint64_t cycle) const {
  const auto refused_before = std::lower_bound(refused_.begin(), refused_.end(), cycle) - refused_.begin();
  const session::Input& input = recording_.inputs[cycle - 1 + static_cast<std::uint64_t>(refused_before)];
  const drill::BitPose bit = bits_.empty() ? drill::BitPose{input.tip_mm, normalized(input.axis)} : bits_[cycle - 1];
  return {input, bit, thrust_N_[cycle - 1], bit.tip_mm.z, goneAt(cycle)};
}

void Player::seek(std::uint64_t cycle) {
  cycle = std::min(cycle, cycles());
  const std::uint64_t wanted = goneAt(cycle);
  std::uint64_t gone = goneAt(cycle_);
  if (std::max(gone, wanted) - std::min(gone, wanted) > apart_) {
    const std::uint64_t frame = std::min<std::uint64_t>((wanted + apart_ / 2) / apart_, keyframes_.size());
    volume_.alive = frame == 0 ? recording_.volume.alive : keyframes_[frame - 1];
    gone = frame * apart_;
  }
  const std::span<const std::uint32_t> all(removed_);
  if (gone < wanted) setAlive(all.subspan(gone, wanted - gone), false, volume_.alive);
  if (wanted < gone) setAlive(all.subspan(wanted, gone - wanted), true, volume_.alive);
  cycle_ = cycle;
}

std::size_t Player::bytes() const {
  const auto of = [](const auto& values) { return values.capacity() * sizeof(values[0]); };
  std::size_t sum = of(recording_.inputs) + of(thrust_N_) + of(bits_) + of(gone_) + of(refused_) + of(removed_);
  for (const auto& frame : keyframes_) sum += of(frame);
  return sum + volume_.bytes() + recording_.volume.bytes();
}

}  // namespace spinaltap::recording
