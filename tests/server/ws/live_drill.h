// tests/server/ws/live_drill.h - messages of a drill, and what the same poses give in a session of one's own.
#pragma once
#include <optional>
#include <vector>

#include "core/session/scenes.h"
#include "core/wire/drill_messages.h"
#include "server/jobs/drill_job.h"
#include "tests/server/small_case.h"

namespace spinaltap::test {

using Bytes = std::vector<std::byte>;

/// Drives a bit that is held rigidly, as the browser does.
inline wire::Hello rigidHello() {
  wire::Hello hello;
  hello.rigid = true;
  return hello;
}
inline Bytes helloBytes(const wire::Hello& hello = rigidHello()) { return wire::encode(wire::ClientMessage(hello)); }
inline Bytes resumeBytes(const wire::Token& token) {
  wire::Hello hello = rigidHello();
  hello.resumes = true, hello.token = token;
  return helloBytes(hello);
}
inline Bytes watchBytes() {
  wire::Hello hello;
  hello.role = wire::Role::Watch;
  return helloBytes(hello);
}
inline Bytes finishBytes() { return wire::encode(wire::ClientMessage(wire::Finish{})); }
inline Bytes posesBytes(std::uint32_t first, std::vector<session::Input> poses) {
  return wire::encode(wire::ClientMessage(wire::Poses{first, std::move(poses)}));
}

/// `hand` from just before the bone on, with some poses that are none.
inline std::vector<session::Input> somePoses(std::uint64_t count) {
  std::vector<session::Input> poses;
  for (std::uint64_t i = 0; i < count; ++i) {
    session::Input input = session::sceneInput(session::Scene::On, i, -0.5);
    input.tip_mm += session::sceneInput(session::Scene::Hand, i, 0).tip_mm * 0.5;
    if (i % 97 == 50) input.tip_mm.x = 0.0 / 0.0 * static_cast<double>(i);
    input.spinning = i % 13 != 5;
    poses.push_back(input);
  }
  return poses;
}

struct Expected {
  std::uint64_t start_hash = 0, hash = 0, cycle = 0, removed_total = 0;
  double thrust_N = 0;
  session::Output last;
  haptics::LocalModel local;
};

/// The core alone, in this process.
inline Expected runLocally(store::Store& store, const SmallCase& small, const std::vector<session::Input>& poses,
                           const std::optional<haptics::Coupling>& coupling = {}) {
  jobs::DrillSite site = jobs::siteOfPath(store, small.case_id, small.path_id).value();
  site.config.coupling = coupling;
  session::Session session = session::Session::create(std::move(site.volume), site.config).value();
  Expected expected;
  expected.start_hash = session.stateHash();
  for (const auto& pose : poses) {
    const session::Output output = session.step(pose);
    expected.cycle = output.cycle;
    expected.removed_total = output.removed_total;
    expected.thrust_N = output.thrust_N;
    expected.last = output;
  }
  expected.hash = session.stateHash();
  expected.local = session.localModel();
  return expected;
}

template <class Message>
Message decoded(const Bytes& bytes) {
  const auto message = wire::decodeServerMessage(bytes);
  EXPECT_TRUE(message.has_value() && std::holds_alternative<Message>(*message));
  return message && std::holds_alternative<Message>(*message) ? std::get<Message>(*message) : Message{};
}

/// The next feedback: a slow machine may say in between that it is behind.
template <class Socket>
wire::Feedback nextFeedback(Socket& socket) {
  Bytes bytes = socket.receive().payload;
  for (; !bytes.empty() && bytes[0] == static_cast<std::byte>(wire::MessageType::Status);) {
    bytes = socket.receive().payload;
  }
  return decoded<wire::Feedback>(bytes);
}

}  // namespace spinaltap::test
