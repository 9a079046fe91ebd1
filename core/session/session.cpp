#include "core/session/session.h"

#include <algorithm>
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

Result<void> checkDrive(const Config& config) {
  if (!(config.speed_rpm > 0 && config.speed_rpm <= 1e5)) {
    return fail(ErrorCode::InvalidArgument, "session: speed must be above 0 and at most 100000 rpm");
  }
  if (!config.coupling) return {};
  if (!(config.coupling->stiffness_N_mm >= 1e-3 && config.coupling->stiffness_N_mm <= 1e6)) {
    return fail(ErrorCode::InvalidArgument, "session: stiffness of the coupling must be 0.001 to 1000000 N/mm");
  }
  if (!(config.coupling->damping_N_s_mm >= 0 && config.coupling->damping_N_s_mm <= 1e3)) {
    return fail(ErrorCode::InvalidArgument, "session: damping of the coupling must be 0 to 1000 N s/mm");
  }
  return {};
}

drill::BitPose poseOf(const haptics::Rod& rod) { return {rod.tip_mm, rod.axis}; }

}  // namespace

Result<Session> Session::create(point_volume::PointVolume volume, const Config& config) {
  if (auto ok = plan::checkBit(config.bit); !ok) return tl::unexpected(ok.error());
  if (auto ok = checkDrive(config); !ok) return tl::unexpected(ok.error());
  if (auto ok = checkVolume(volume); !ok) return tl::unexpected(ok.error());
  auto engine = drill::makeEngine(config.engine, volume, config.bit);
  if (!engine) return tl::unexpected(engine.error());
  return Session(std::move(volume), config, std::move(*engine));
}

Session::Session(point_volume::PointVolume volume, Config config, std::unique_ptr<drill::Engine> engine)
    : volume_(std::move(volume)),
      config_(std::move(config)),
      engine_(std::move(engine)),
      sweep_(volume_.lattice, config_.bit),
      contact_(volume_.lattice, config_.bit),
      proxy_(config_.coupling.value_or(haptics::Coupling{}), {config_.speed_rpm, config_.bit.diameter_mm}) {}

bool Session::holdRigidly(const Input& input, const haptics::Rod& hand, double seconds, drill::RemovedSink removed,
                          drill::Removal& removal) {
  if (seconds > 0) {
    const double feed_mm_s = dot(hand.tip_mm - hand_.tip_mm, hand.axis) / seconds;
    reaction_ = proxy_.carry(hand, contact_.meet(volume_, poseOf(hand_)), feed_mm_s, input.spinning);
  } else {
    proxy_.place(hand);
  }
  int cuts = 0;
  const auto cut = [&] {
    const std::optional<drill::BitPose> pose = sweep_.next();
    if (pose) removal += engine_->step(volume_, *pose, removed);
    ++cuts;
    return pose.has_value();
  };
  while (!sweep_.add(poseOf(hand), input.spinning)) cut();
  while (cuts < kMostCuts && cut()) {
  }
  return !sweep_.done();
}

bool Session::follow(const Input& input, const haptics::Rod& hand, double seconds, drill::RemovedSink removed,
                     drill::Removal& removal) {
  const auto cut = [&] {
    (void)sweep_.add(poseOf(proxy_.rod()), input.spinning);  // nothing waits: every step is cut at once
    while (const std::optional<drill::BitPose> pose = sweep_.next()) removal += engine_->step(volume_, *pose, removed);
  };
  if (cycle_ == 0) {
    proxy_.place(hand);
    cut();
    return false;
  }
  if (!(seconds > 0)) return false;
  double left = 1.0;
  for (int n = 0; n < kMostSteps && left > 0; ++n) {
    const drill::BitPose from = poseOf(proxy_.rod());
    reaction_ = proxy_.step(hand_, hand, contact_.meet(volume_, from),
                            {left * seconds, input.spinning, contact_.longestStep_mm(from), config_.bit.length_mm});
    if (!input.spinning && contact_.isBlocked(volume_, poseOf(proxy_.rod())) && !contact_.isBlocked(volume_, from)) {
      // Facets are apart, and an edge of bone may come between them; no point ever gets inside.
      proxy_.place({from.tip_mm, from.axis});
      reaction_ = proxy_.stand(hand_, hand, left * seconds);
      return false;
    }
    left *= 1.0 - reaction_.done;
    cut();
  }
  return left > 0;
}

Output Session::step(const Input& input, drill::RemovedSink removed) noexcept {
  Output output;
  const double axis_length = norm(input.axis);
  output.status = statusOf(input, axis_length);
  if (output.status == Status::Ok && cycle_ > 0 && input.t_us < last_t_us_) output.status = Status::RefusedTime;
  if (output.status == Status::Ok) {
    const haptics::Rod hand{input.tip_mm, input.axis / axis_length};
    // The client's clock has no known origin, so the first cycle lasts no time.
    const double elapsed_s = cycle_ > 0 ? static_cast<double>(input.t_us - last_t_us_) * 1e-6 : 0;
    const double seconds = std::min(elapsed_s, haptics::kPause_s);
    drill::Removal removal;
    output.behind = config_.coupling ? follow(input, hand, seconds, removed, removal)
                                     : holdRigidly(input, hand, seconds, removed, removal);
    hand_ = hand;
    ++cycle_;
    last_t_us_ = input.t_us;
    removed_total_ += removal.count;
    density_total_ += removal.density_sum_mg_cm3;
    removed_hash_ += removal.hash_delta;
    output.removed = removal.count;
    output.force_N = reaction_.force_N;
    output.torque_Nmm = reaction_.torque_Nmm;
    output.thrust_N = 0.0 - reaction_.force_N.z;
    output.depth_mm = proxy_.rod().tip_mm.z;
  }
  output.bit = poseOf(proxy_.rod());
  output.cycle = cycle_;
  output.removed_total = removed_total_;
  output.state_hash = stateHash();
  return output;
}

haptics::LocalModel Session::localModel() const noexcept {
  const haptics::Rod& rod = proxy_.rod();
  const haptics::Meeting meeting = contact_.meet(volume_, poseOf(rod));
  std::array<double, haptics::kDepthsAhead> frontal_mm2{meeting.frontal_mm2};
  for (std::size_t i = 1; i < frontal_mm2.size(); ++i) {
    const drill::BitPose ahead{rod.tip_mm + rod.axis * haptics::kAhead_mm[i], rod.axis};
    frontal_mm2[i] = contact_.frontal_mm2(volume_, ahead);
  }
  return haptics::localModel(rod, meeting, frontal_mm2);
}

std::uint64_t Session::stateHash() const {
  std::uint64_t hash = combine(0, removed_hash_);
  for (const std::uint64_t count : {removed_total_, density_total_, cycle_, last_t_us_}) hash = combine(hash, count);
  const haptics::Rod& rod = proxy_.rod();
  for (const Vec3& v : {rod.tip_mm, rod.axis, reaction_.force_N, reaction_.torque_Nmm}) {
    for (const double value : {v.x, v.y, v.z}) hash = combine(hash, bitsOf(value));
  }
  return hash;
}

}  // namespace spinaltap::session
