#include "core/session/session.h"

#include <cmath>
#include <utility>

#include "core/base/hash.h"

namespace spinaltap::session {
namespace {

constexpr double kFarthest_mm = 1e6;
constexpr double kShortestAxis = 1e-6, kLongestAxis = 1e6;

// A recording or a message may hold any lattice with any amount of data behind it.
Result<void> checkVolume(const point_volume::PointVolume& volume) {
  if (auto ok = point_volume::checkLattice(volume.lattice); !ok) return ok;
  const std::uint64_t points = volume.lattice.points();
  if (volume.alive.size() != (points + 63) / 64 || volume.density_mg_cm3.size() != points) {
    return fail(ErrorCode::InvalidArgument, "point volume: alive bits or densities do not fit the lattice");
  }
  if (points % 64 != 0 && (volume.alive.back() >> (points % 64)) != 0) {
    return fail(ErrorCode::InvalidArgument, "point volume: alive bits past the last point");
  }
  return {};
}

Status statusOf(const Input& input, double axis_length) {
  const Vec3& tip = input.tip_mm;
  if (!isFinite(tip) || !isFinite(input.axis)) return Status::RefusedNotFinite;
  if (std::abs(tip.x) > kFarthest_mm || std::abs(tip.y) > kFarthest_mm || std::abs(tip.z) > kFarthest_mm) {
    return Status::RefusedNotFinite;
  }
  if (!(axis_length >= kShortestAxis && axis_length <= kLongestAxis)) return Status::RefusedAxis;
  return Status::Ok;
}

}  // namespace

Result<Session> Session::create(point_volume::PointVolume volume, const Config& config) {
  if (auto ok = plan::checkBit(config.bit); !ok) return tl::unexpected(ok.error());
  if (auto ok = checkVolume(volume); !ok) return tl::unexpected(ok.error());
  auto engine = drill::makeEngine(config.engine, volume, config.bit);
  if (!engine) return tl::unexpected(engine.error());
  return Session(std::move(volume), config, std::move(*engine));
}

Session::Session(point_volume::PointVolume volume, Config config, std::unique_ptr<drill::Engine> engine)
    : volume_(std::move(volume)),
      config_(std::move(config)),
      engine_(std::move(engine)),
      sweep_(volume_.lattice, config_.bit) {}

Output Session::step(const Input& input, drill::RemovedSink removed) noexcept {
  Output output;
  const double axis_length = norm(input.axis);
  output.status = statusOf(input, axis_length);
  if (output.status == Status::Ok && cycle_ > 0 && input.t_us < last_t_us_) output.status = Status::RefusedTime;
  if (output.status == Status::Ok) {
    drill::Removal removal;
    int cuts = 0;
    const auto cut = [&] {
      const std::optional<drill::BitPose> pose = sweep_.next();
      if (pose) removal += engine_->step(volume_, *pose, removed);
      ++cuts;
      return pose.has_value();
    };
    while (!sweep_.add({input.tip_mm, input.axis / axis_length}, input.spinning)) cut();
    while (cuts < kMostCuts && cut()) {
    }
    output.behind = !sweep_.done();
    // The client's clock has no known origin, so the first cycle lasts no time; its mass waits for the second.
    const std::uint64_t elapsed_us = cycle_ > 0 ? input.t_us - last_t_us_ : 0;
    const double removed_mg = static_cast<double>(removal.density_sum_mg_cm3) *
                              point_volume::pointVolume_mm3(volume_.lattice) * 1e-3;  // mg/cm3 * mm3 = 1e-3 mg
    output.thrust_N = thrust_.step(removed_mg, elapsed_us);
    ++cycle_;
    last_t_us_ = input.t_us;
    removed_total_ += removal.count;
    density_total_ += removal.density_sum_mg_cm3;
    removed_hash_ += removal.hash_delta;
    output.removed = removal.count;
    output.depth_mm = input.tip_mm.z;
  }
  output.cycle = cycle_;
  output.removed_total = removed_total_;
  output.state_hash = stateHash();
  return output;
}

std::uint64_t Session::stateHash() const {
  std::uint64_t hash = combine(0, removed_hash_);
  hash = combine(hash, removed_total_);
  hash = combine(hash, density_total_);
  hash = combine(hash, bitsOf(thrust_.thrust_N()));
  hash = combine(hash, cycle_);
  return combine(hash, last_t_us_);
}

}  // namespace spinaltap::session
