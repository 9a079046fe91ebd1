#include "server/haptic_client/device_loop.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace spinaltap::haptic_client {
namespace {

/// The rotation that takes one axis to another.
Mat3 turnFrom(const Vec3& from, const Vec3& to) {
  const Mat3 a{haptics::toolX(from), haptics::toolY(from), from}, b{haptics::toolX(to), haptics::toolY(to), to};
  const auto column = [&](const Vec3& v) { return b * transposeTimes(a, v); };
  return {column({1, 0, 0}), column({0, 1, 0}), column({0, 0, 1})};
}

haptics::Rod rodOf(const HandPose& pose) { return {pose.tip_mm, normalized(pose.axis)}; }

bool isPose(const HandPose& pose) {
  const double length = norm(pose.axis);
  return isFinite(pose.tip_mm) && isFinite(pose.axis) && length > 1e-6 && length < 1e6;
}

}  // namespace

wire::Hello helloFrom(const DeviceTraits& traits) {
  wire::Hello hello;
  hello.max_force_N = traits.max_force_N;
  hello.max_stiffness_N_mm = traits.max_stiffness_N_mm;
  hello.damping_N_s_mm = traits.damping_N_s_mm;
  hello.device_rate_hz = static_cast<std::uint32_t>(std::lround(traits.rate_hz));
  return hello;
}

LoopSetup setupFrom(const wire::Welcome& welcome, const DeviceTraits& traits, double bit_diameter_mm) {
  LoopSetup setup;
  setup.coupling = {welcome.stiffness_N_mm, welcome.damping_N_s_mm};
  setup.drive.diameter_mm = bit_diameter_mm;
  setup.limits.force_scale = welcome.force_scale;
  setup.limits.max_force_N = traits.max_force_N;
  setup.limits.most_brake_N_s_mm = 0.5 * traits.mass_kg / 1000 * traits.rate_hz;
  setup.limits.renders_torque = traits.renders_torque;
  return setup;
}

DeviceLoop::DeviceLoop(Device& device, Link& link, const LoopSetup& setup, OnAnswer on_answer)
    : device_(device),
      link_(link),
      setup_(setup),
      on_answer_(std::move(on_answer)),
      port_(setup.coupling, setup.drive, setup.limits) {}

haptics::Rod DeviceLoop::seen(const HandPose& pose) const {
  const haptics::Rod rod = rodOf(pose);
  return {rod.tip_mm + shift_mm_, normalized(turn_ * rod.axis)};
}

Result<Tick> DeviceLoop::tick(std::uint64_t t_us) {
  const double passed_s = 1e-6 * static_cast<double>(t_us - t_us_);
  seconds_ = std::clamp(passed_s, 1e-6, haptics::kPause_s);
  t_us_ = t_us;
  Result<HandPose> pose = device_.read(t_us);
  if (pose && !isPose(*pose)) pose = fail(ErrorCode::NotFinite, "the device's position is no position");
  if (!pose) {
    (void)device_.push({}, {});  // it may be gone
    return tl::unexpected(pose.error());
  }
  listen();
  now_.t_us = t_us;
  if (now_.phase == Phase::Greeting) greet(*pose);
  if (now_.phase == Phase::Holding && (isStale() || passed_s > haptics::kPause_s)) letGo();
  if (now_.phase == Phase::LetGo) takeUp(*pose);
  if (now_.phase == Phase::Holding) hold(*pose, seconds_);
  if (now_.phase == Phase::LetGo) fade(*pose, seconds_);
  now_.sent = sent_, now_.all_answered = allAnswered();
  if (auto pushed = device_.push(now_.felt.force_N, now_.felt.torque_Nmm); !pushed) {
    return tl::unexpected(pushed.error());
  }
  return now_;
}

void DeviceLoop::listen() {
  if (const std::uint32_t resumed = link_.resumed(); resumed != resumed_) resumed_ = resumed, resumed_at_ = sent_;
  Answer answer;
  while (link_.take(answer)) {
    const std::uint32_t seq = answer.feedback.seq;
    const bool expected = static_cast<std::int32_t>(seq - answered_) >= 0 && static_cast<std::int32_t>(sent_ - seq) > 0;
    if (!expected) continue;
    answered_ = seq + 1;
    last_ = answer.feedback;
    haptics::LocalModel model = answer.feedback.local;
    model.bit = {answer.feedback.tip_mm, answer.feedback.axis};
    port_.learn(seq, model);
    if (on_answer_) on_answer_({answer, past_[seq % past_.size()], setup_.limits.force_scale});
  }
}

bool DeviceLoop::isStale() const {
  if (answered_ == sent_) return false;
  const Tick& oldest = past_[answered_ % past_.size()];
  return sent_ - answered_ >= kMostUnanswered ||
         1e-6 * static_cast<double>(t_us_ - oldest.t_us) > setup_.let_go_after_s;
}

void DeviceLoop::send(const haptics::Rod& hand, bool spinning) {
  session::Input input;
  input.t_us = t_us_, input.tip_mm = hand.tip_mm, input.axis = hand.axis, input.spinning = spinning;
  now_.hand = hand;
  past_[sent_ % past_.size()] = now_;
  link_.send(sent_++, input);
}

/// One pose, and the drill is there once it is answered: whoever comes to bone has been in touch before.
void DeviceLoop::greet(const HandPose& pose) {
  const bool unheard = resumed_ > 0 && resumed_at_ == sent_ && answered_ != sent_;  // taken, and its answer lost
  if (sent_ == 0 || unheard) {
    const haptics::Rod hand = seen(pose);
    port_.place(hand);
    (void)port_.move(sent_, hand, seconds_, pose.spinning);
    send(hand, pose.spinning);
  } else if (answered_ == sent_) {
    now_.phase = Phase::Holding;
    device_.holds(true);
  }
}

void DeviceLoop::hold(const HandPose& pose, double seconds) {
  const haptics::Rod hand = seen(pose);
  const haptics::Reaction bone = port_.move(sent_, hand, seconds, pose.spinning);
  bone_N_ = haptics::fromTool(port_.rod().axis, bone.force_N);
  bone_Nmm_ = haptics::fromTool(port_.rod().axis, bone.torque_Nmm);
  now_.felt = port_.push(rodOf(pose), bone_N_, transposeTimes(turn_, bone_Nmm_), seconds);
  send(hand, pose.spinning);
}

void DeviceLoop::letGo() {
  now_.phase = Phase::LetGo;
  faded_ = 0, asked_ = false;
  ++let_go_;
  device_.holds(false);
}

void DeviceLoop::fade(const HandPose& pose, double seconds) {
  faded_ = std::min(1.0, faded_ + seconds / kFade_s);
  const double left = 1.0 - faded_;
  now_.felt = port_.push(rodOf(pose), bone_N_ * left, transposeTimes(turn_, bone_Nmm_) * left, seconds);
}

/// Asks where the bit is, with a hand that stands where the bit was; then goes on from there.
void DeviceLoop::takeUp(const HandPose& pose) {
  if (asked_ && answered_ == sent_) {
    const haptics::Rod hand = rodOf(pose), bit{last_.tip_mm, last_.axis};
    turn_ = turnFrom(hand.axis, bit.axis);
    shift_mm_ = bit.tip_mm - hand.tip_mm;
    now_.phase = Phase::Holding;
    device_.holds(true);
    return;
  }
  // What the server took before the line broke may never be answered by itself; the next pose is.
  const bool is_heard = answered_ == sent_ || (resumed_ > 0 && resumed_at_ == sent_);
  if (!is_heard) return;
  const haptics::Rod bit{last_.tip_mm, last_.axis};
  port_.place(bit);
  (void)port_.move(sent_, bit, seconds_, pose.spinning);
  send(bit, pose.spinning);
  asked_ = true;
}

}  // namespace spinaltap::haptic_client
