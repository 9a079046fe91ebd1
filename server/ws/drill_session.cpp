#include "server/ws/drill_session.h"

#include <exception>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/session/session.h"
#include "core/wire/drill_messages.h"
#include "server/jobs/drill_job.h"
#include "server/jobs/recording_file.h"

namespace spinaltap::ws {

Answer refusal(const std::string& reason, std::uint16_t close_code) {
  return {wire::encode(wire::ServerMessage(wire::Refused{reason})), close_code};
}

namespace {

Answer send(const wire::ServerMessage& message, std::uint16_t close_code = 0) {
  return {wire::encode(message), close_code};
}

/// What exists once the trainee has said hello.
struct Drill {
  session::Session session;
  metrics::Accumulator accumulator;
  std::optional<Field> field;
  jobs::RecordingFile recording;
  std::uint64_t inputs = 0;
  std::optional<std::uint32_t> next_seq;
  std::vector<std::uint32_t> removed = {};  ///< by the last pose
};

}  // namespace

struct DrillSession::State {
  store::Store& store;
  Ticket ticket;
  std::optional<Drill> drill;
  bool ended = false;

  Answer end(Answer answer) {
    ended = true;
    keep(false);
    return answer;
  }
  /// The metrics, and the recording's id; empty when there was nothing to keep.
  std::pair<std::string, std::string> keep(bool complete);
  Answer hello();
  Answer poses(const wire::Poses& batch);
  Answer finish();
};

std::pair<std::string, std::string> DrillSession::State::keep(bool complete) {
  if (!drill) return {"{}", ""};
  const metrics::Metrics measured = drill->accumulator.finish(drill->field ? &*drill->field : nullptr);
  std::string metrics = jobs::figuresOf(measured).dump();
  std::string id;
  if (drill->inputs == 0) {
    drill->recording.discard();
  } else if (const auto row = drill->recording.keep(complete, metrics); row) {
    id = row->id;
  }  // else the file stays in live/ and the next start brings it in
  drill.reset();
  return {std::move(metrics), std::move(id)};
}

Answer DrillSession::State::hello() {
  if (drill) return end(refusal("hello: said twice", kProtocolError));
  auto site = jobs::siteOfPath(store, ticket.case_id, ticket.path_id);
  if (!site) return end(refusal(site.error().message, kPolicy));
  const recording::Header header{SPINALTAP_VERSION, ticket.case_id, ticket.path_id, "", site->config};
  auto recording = jobs::RecordingFile::begin(store, header, site->volume);
  if (!recording) return end(refusal(recording.error().message, kInternalError));
  const auto alive = static_cast<std::uint32_t>(point_volume::countAlive(site->volume));
  auto session = session::Session::create(std::move(site->volume), site->config);
  if (!session) {
    recording->discard();
    return end(refusal(session.error().message, kInternalError));
  }
  drill.emplace(Drill{
      std::move(*session), metrics::Accumulator(site->plan), std::move(site->field), std::move(*recording), 0, {}});
  return send(wire::Welcome{drill->session.stateHash(), alive});
}

Answer DrillSession::State::poses(const wire::Poses& batch) {
  if (!drill) return end(refusal("poses: before hello", kProtocolError));
  if (drill->next_seq && *drill->next_seq != batch.first_seq) {
    return end(refusal("poses: sequence number " + std::to_string(batch.first_seq) + " where " +
                           std::to_string(*drill->next_seq) + " comes next",
                       kProtocolError));
  }
  if (drill->inputs + batch.poses.size() > kMostInputs) return end(refusal("poses: the drill is too long", kPolicy));
  wire::Feedback feedback;
  for (const session::Input& input : batch.poses) {
    drill->removed.clear();
    const session::Output output = drill->session.step(input, [this](std::span<const std::uint32_t> some) {
      drill->removed.insert(drill->removed.end(), some.begin(), some.end());
    });
    if (const auto kept = drill->recording.append(input, output, drill->removed, drill->session.volume()); !kept) {
      return end(refusal(kept.error().message, kInternalError));
    }
    if (output.status == session::Status::Ok) {
      drill->accumulator.add({input.t_us, input.tip_mm, input.axis, input.spinning, output.thrust_N, drill->removed});
    }
    feedback.status = std::max(feedback.status, output.status);
    feedback.cycle = output.cycle;
    feedback.removed_total = output.removed_total;
    feedback.thrust_N = output.thrust_N;
    feedback.depth_mm = output.depth_mm;
  }
  drill->inputs += batch.poses.size();
  drill->next_seq = batch.first_seq + static_cast<std::uint32_t>(batch.poses.size());
  feedback.seq = *drill->next_seq - 1;
  feedback.state_hash = drill->session.stateHash();
  return send(feedback);
}

Answer DrillSession::State::finish() {
  if (!drill) return end(refusal("finish: before hello", kProtocolError));
  const bool drilled = drill->inputs > 0;
  auto [metrics, id] = keep(true);
  if (drilled && id.empty()) return end(refusal("the recording could not be kept", kInternalError));
  ended = true;
  return send(wire::Finished{id, metrics}, kNormal);
}

DrillSession::DrillSession(store::Store& store, Ticket ticket)
    : state_(new State{store, std::move(ticket), {}, false}) {}

DrillSession::~DrillSession() {
  try {
    hangUp();
  } catch (const std::exception&) {
    // out of memory: the recording stays in live/, and the next start brings it in
    state_->ended = true;
  }
}

Answer DrillSession::onMessage(std::span<const std::byte> bytes) {
  if (state_->ended) return {};
  const auto message = wire::decodeClientMessage(bytes);
  if (!message) return state_->end(refusal(message.error().message, kProtocolError));
  if (std::holds_alternative<wire::Hello>(*message)) return state_->hello();
  if (const auto* batch = std::get_if<wire::Poses>(&*message)) return state_->poses(*batch);
  return state_->finish();
}

void DrillSession::hangUp() {
  if (state_->ended) return;
  state_->ended = true;
  state_->keep(false);
}

}  // namespace spinaltap::ws
