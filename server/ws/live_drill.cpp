#include "server/ws/live_drill.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/haptics/proxy.h"
#include "core/plan/path.h"
#include "core/session/told_model.h"
#include "server/jobs/drill_job.h"

namespace spinaltap::ws {
namespace {

constexpr double kLeastStiffness_N_mm = 1e-3;  // session::Session takes no less

/// Shortens force and torque together until the force fits, and says so.
void limit(double max_force_N, Vec3& force_N, Vec3& torque_Nmm, bool& limited) {
  const double length = norm(force_N);
  limited = max_force_N > 0 && length > max_force_N;
  if (!limited) return;
  force_N = force_N * (max_force_N / length);
  torque_Nmm = torque_Nmm * (max_force_N / length);
}

}  // namespace

std::optional<haptics::Coupling> couplingFor(const wire::Hello& hello) {
  if (hello.rigid) return {};
  haptics::Coupling coupling;
  if (hello.max_stiffness_N_mm > 0)
    coupling.stiffness_N_mm = std::min(coupling.stiffness_N_mm, hello.max_stiffness_N_mm);
  if (hello.damping_N_s_mm > 0 && hello.device_rate_hz > 0) {
    coupling.stiffness_N_mm = haptics::boundedStiffness_N_mm(coupling.stiffness_N_mm, hello.damping_N_s_mm,
                                                             1.0 / hello.device_rate_hz, coupling.damping_N_s_mm);
  }
  coupling.stiffness_N_mm = std::max(coupling.stiffness_N_mm, kLeastStiffness_N_mm);
  return coupling;
}

double forceScaleFor(const wire::Hello& hello) {
  return hello.max_force_N > 0 ? std::min(1.0, hello.max_force_N / haptics::kFullForce_N) : 1.0;
}

struct LiveDrill::State {
  session::Session session;
  Frame frame;
  metrics::Accumulator accumulator;
  std::optional<Field> field;
  jobs::RecordingFile recording;
  std::uint32_t points_alive = 0;
  double force_scale = 1, max_force_N = 0;
  std::uint64_t inputs = 0;
  std::optional<std::uint32_t> next_seq = std::nullopt;
  std::uint64_t hash_due = 0;               ///< the cycle at or past which the next hash is sent
  std::vector<std::uint32_t> removed = {};  ///< by the last pose
  session::ToldModel told = {};

  void answer(const session::Input& input, const session::Output& output, wire::Feedback& feedback);
  void measure(const session::Input& input, const session::Output& output);
};

LiveDrill::LiveDrill(std::unique_ptr<State> state) : state_(std::move(state)) {}
LiveDrill::~LiveDrill() = default;

Result<std::unique_ptr<LiveDrill>> LiveDrill::open(store::Store& store, const Ticket& ticket, const wire::Hello& hello,
                                                   const jobs::Disk& disk) {
  auto site = jobs::siteOfPath(store, ticket.case_id, ticket.path_id);
  if (!site) return tl::unexpected(site.error());
  const auto path = store.findPath(ticket.case_id, ticket.path_id);
  if (!path) return tl::unexpected(path.error());
  site->config.coupling = couplingFor(hello);
  const recording::Header header{SPINALTAP_VERSION, ticket.case_id, ticket.path_id, "", site->config};
  auto recording = jobs::RecordingFile::begin(store, header, site->volume, disk);
  if (!recording) return tl::unexpected(recording.error());
  const auto alive = static_cast<std::uint32_t>(point_volume::countAlive(site->volume));
  auto session = session::Session::create(std::move(site->volume), site->config);
  if (!session) {
    recording->discard();
    return tl::unexpected(session.error());
  }
  std::unique_ptr<LiveDrill> made(new LiveDrill(
      std::make_unique<State>(State{std::move(*session), plan::pathFrame(path->path), metrics::Accumulator(site->plan),
                                    std::move(site->field), std::move(*recording), alive})));
  made->setDevice(hello);
  return made;
}

void LiveDrill::setDevice(const wire::Hello& hello) {
  state_->force_scale = forceScaleFor(hello);
  state_->max_force_N = hello.max_force_N;
}

wire::Welcome LiveDrill::welcome() const {
  wire::Welcome welcome;
  welcome.state_hash = state_->session.stateHash();
  welcome.points_alive = state_->points_alive;
  welcome.next_seq = state_->next_seq.value_or(0);
  if (const auto& coupling = state_->session.config().coupling) {
    welcome.stiffness_N_mm = coupling->stiffness_N_mm;
    welcome.damping_N_s_mm = coupling->damping_N_s_mm;
  }
  welcome.force_scale = state_->force_scale;
  welcome.hash_every = kHashEvery;
  return welcome;
}

Result<void> LiveDrill::accept(const wire::Poses& batch) {
  State& state = *state_;
  if (state.next_seq && *state.next_seq != batch.first_seq) {
    return fail(ErrorCode::InvalidArgument, "poses: sequence number " + std::to_string(batch.first_seq) + " where " +
                                                std::to_string(*state.next_seq) + " comes next");
  }
  if (state.inputs + batch.poses.size() > kMostInputs) return fail(ErrorCode::Limit, "poses: the drill is too long");
  state.next_seq = batch.first_seq + static_cast<std::uint32_t>(batch.poses.size());
  return {};
}

void LiveDrill::State::measure(const session::Input& input, const session::Output& output) {
  if (output.status != session::Status::Ok) return;
  accumulator.add({input.t_us, output.bit.tip_mm, output.bit.axis, input.spinning, output.thrust_N, removed});
}

void LiveDrill::State::answer(const session::Input& input, const session::Output& output, wire::Feedback& feedback) {
  feedback.t_us = input.t_us;
  feedback.status = std::max(feedback.status, output.status);
  feedback.behind = output.behind;
  feedback.cycle = output.cycle;
  feedback.removed_total = output.removed_total;
  feedback.force_N = output.force_N * force_scale;
  feedback.torque_Nmm = output.torque_Nmm * force_scale;
  limit(max_force_N, feedback.force_N, feedback.torque_Nmm, feedback.limited);
  feedback.force_patient_N = frame.directionToPatient(haptics::fromTool(output.bit.axis, feedback.force_N));
  feedback.tip_mm = output.bit.tip_mm;
  feedback.axis = output.bit.axis;
  feedback.depth_mm = output.depth_mm;
  feedback.thrust_N = output.thrust_N;
  feedback.state_hash = output.state_hash;
  if (output.cycle >= hash_due) {
    feedback.has_hash = true;
    hash_due = (output.cycle / kHashEvery + 1) * kHashEvery;
  }
}

Result<void> LiveDrill::drill(const wire::Poses& batch, std::size_t from, std::size_t to, wire::Feedback& feedback) {
  State& state = *state_;
  for (std::size_t i = from; i < to; ++i) {
    const session::Input& input = batch.poses[i];
    state.removed.clear();
    const session::Output output = state.session.step(input, [&state](std::span<const std::uint32_t> some) {
      state.removed.insert(state.removed.end(), some.begin(), some.end());
    });
    if (auto kept = state.recording.append(input, output, state.removed, state.session.volume()); !kept) return kept;
    state.measure(input, output);
    state.answer(input, output, feedback);
    ++state.inputs;
    feedback.seq = batch.first_seq + static_cast<std::uint32_t>(i);
  }
  // The answer goes out now. Who holds the bit rigidly moves no bit of its own through the model.
  const bool wanted = to == batch.poses.size() && state.session.config().coupling.has_value();
  if (wanted) feedback.local = state.told.of(state.session, {feedback.tip_mm, feedback.axis});
  return {};
}

std::size_t LiveDrill::waitingBytes() const { return state_->recording.waitingBytes(); }

LiveDrill::Kept LiveDrill::keep(bool complete) {
  State& state = *state_;
  Kept kept;
  kept.metrics_json = jobs::figuresOf(state.accumulator.finish(state.field ? &*state.field : nullptr)).dump();
  if (state.inputs == 0) {
    state.recording.discard();
    return kept;
  }
  // else the file stays in live/, and the next start brings it in
  const auto row = state.recording.keep(complete, kept.metrics_json);
  kept.failed = !row;
  if (row) kept.recording_id = row->id;
  return kept;
}

}  // namespace spinaltap::ws
