// What the messages of server/contract/haptics.md do to a session.
#include <sys/random.h>

#include <algorithm>
#include <cstdlib>

#include "server/ws/drill_loop_parts.h"

namespace spinaltap::ws {
namespace {

/// All the same however many bytes agree, so that the time taken says nothing.
bool isSame(const wire::Token& a, const wire::Token& b) {
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

}  // namespace

/// False when no further frame of this client is looked at now.
bool DrillLoop::onFrame(Client& client, const FrameReader::Frame& frame) {
  using Got = FrameReader::Got;
  Connection& connection = client.connection;
  switch (frame.got) {
    case Got::Malformed:
    case Got::TooLarge:
      client.deaf = true;
      connection.close(frame.got == Got::TooLarge ? kTooLarge : kProtocolError);
      leave(client);
      return true;  // what still comes is read and thrown away, until it ends
    case Got::Ping:
      connection.pong(frame.payload);
      return true;
    case Got::Pong:
      return true;
    case Got::Close: {
      const bool ours = connection.isClosing();
      const std::uint16_t code = frame.payload.size() < 2
                                     ? kNormal
                                     : static_cast<std::uint16_t>(std::to_integer<unsigned>(frame.payload[0]) << 8U |
                                                                  std::to_integer<unsigned>(frame.payload[1]));
      if (!ours) connection.close(code);
      leave(client);
      flush(client);
      drop(connection.socket());
      return false;
    }
    default:
      break;
  }
  if (connection.isClosing()) return true;
  if (frame.got == Got::Text) {
    refuse(client, "messages are binary", kProtocolError);
    return true;
  }
  onMessage(client, frame.payload);
  return true;
}

void DrillLoop::onMessage(Client& client, std::span<const std::byte> bytes) {
  const bool are_poses = !bytes.empty() && bytes[0] == static_cast<std::byte>(wire::MessageType::Poses);
  if (are_poses && client.kind == Client::Kind::Driver) {
    onPoses(client, bytes);
    return;
  }
  const auto message = wire::decodeClientMessage(bytes);
  if (!message) {
    refuse(client, message.error().message, kProtocolError);
  } else if (const auto* hello = std::get_if<wire::Hello>(&*message)) {
    onHello(client, *hello);
  } else if (client.kind == Client::Kind::New) {
    refuse(client, are_poses ? "poses: before hello" : "finish: before hello", kProtocolError);
  } else if (client.kind == Client::Kind::Watcher) {
    refuse(client, "who watches cannot drive", kPolicy);
  } else {
    onFinish(client);
  }
}

void DrillLoop::onHello(Client& client, const wire::Hello& hello) {
  if (client.kind != Client::Kind::New || !client.seat) {
    refuse(client, "hello: said twice", kProtocolError);
    return;
  }
  client.hello = hello;
  if (hello.role == wire::Role::Watch) {
    watch(client, hello);
  } else if (hello.resumes) {
    resume(client, hello);
  } else {
    drive(client, hello);
  }
}

void DrillLoop::watch(Client& client, const wire::Hello& hello) {
  Seat& seat = *client.seat;
  if (seat.phase != Seat::Phase::Live) return refuse(client, "nobody drives this session yet", kPolicy);
  if (seat.watchers.size() >= kMostWatchers) return refuse(client, "too many watch this session", kPolicy);
  client.kind = Client::Kind::Watcher, client.since = now_;
  client.connection.setRate(hello.max_rate_hz);
  seat.watchers.push_back(&client);
  welcome(client);
  if (!seat.driver) {
    client.connection.send(wire::SessionStatus{wire::StatusCode::Paused, "the trainee is away"});
    return;
  }
  seat.driver->connection.send(wire::SessionStatus{wire::StatusCode::WatcherJoined, "somebody watches"});
  flush(*seat.driver);
}

void DrillLoop::drive(Client& client, const wire::Hello& hello) {
  Seat& seat = *client.seat;
  if (seat.driver) return refuse(client, "somebody drives this session", kPolicy);
  if (seat.phase != Seat::Phase::Vacant) return refuse(client, "this session is resumed by its token alone", kPolicy);
  client.kind = Client::Kind::Driver, client.since = now_;
  client.connection.setRate(hello.max_rate_hz);
  seat.driver = &client;
  open(seat, hello);
}

void DrillLoop::open(Seat& seat, const wire::Hello& hello) {
  if (::getrandom(seat.token.data(), seat.token.size(), 0) != static_cast<ssize_t>(seat.token.size())) std::abort();
  seat.phase = Seat::Phase::Opening;
  const jobs::Disk disk = [&tasks = tasks_](std::function<void()> task) { tasks.post(std::move(task)); };
  tasks_.post([this, id = seat.id, ticket = seat.ticket, hello, disk] {
    auto live = LiveDrill::open(store_, ticket, hello, disk);
    const Error error = live ? Error{} : live.error();
    const auto drill = std::make_shared<std::unique_ptr<LiveDrill>>(live ? std::move(*live) : nullptr);
    post([this, id, drill, error] { opened(id, std::move(*drill), error); });
  });
}

void DrillLoop::opened(const std::string& id, std::unique_ptr<LiveDrill> live, const Error& error) {
  const auto found = seats_.find(id);
  const bool refused = !live;
  if (found == seats_.end() || refused) {
    if (live) tasks_.post([drill = std::shared_ptr<LiveDrill>(std::move(live))] { (void)drill->keep(false); });
    if (found != seats_.end() && found->second->driver) {
      refuse(*found->second->driver, error.message, error.code == ErrorCode::NotFound ? kPolicy : kInternalError);
    }
    if (found != seats_.end()) erase(id);
    return;
  }
  Seat& seat = *found->second;
  seat.live = std::move(live);
  seat.phase = Seat::Phase::Live;
  seat.alone_since = now_;
  if (!seat.driver) return;
  welcome(*seat.driver);
  seat.driver->backlog_since = now_;  // what came meanwhile is not late
  serve(*seat.driver);
}

void DrillLoop::resume(Client& client, const wire::Hello& hello) {
  Seat& seat = *client.seat;
  const bool mine = seat.phase != Seat::Phase::Vacant && isSame(seat.token, hello.token);
  if (!mine) return refuse(client, "the token is not this session's", kPolicy);
  if (seat.phase != Seat::Phase::Live) return refuse(client, "this session cannot be resumed now", kPolicy);
  if (Client* before = seat.driver) {  // dead, but not seen to end
    before->connection.close(kGoingAway);
    leave(*before);
    flush(*before);
  }
  client.kind = Client::Kind::Driver, client.since = now_;
  client.connection.setRate(hello.max_rate_hz);
  seat.driver = &client;
  seat.live->setDevice(hello);
  seat.arrived_t_us = 0;
  ++metrics_.resumed;
  welcome(client);
  tellWatchers(seat, wire::SessionStatus{wire::StatusCode::Resumed, "the trainee is back"});
}

void DrillLoop::welcome(Client& client) {
  wire::Welcome welcome = client.seat->live->welcome();
  welcome.realtime = realtime_;
  if (client.kind == Client::Kind::Driver) welcome.token = client.seat->token;
  client.connection.send(welcome);
}

void DrillLoop::onPoses(Client& client, std::span<const std::byte> bytes) {
  Seat& seat = *client.seat;
  seat.at = 0;
  if (const auto read = wire::decodePoses(bytes, seat.batch); !read) {
    seat.batch.poses.clear();
    refuse(client, read.error().message, kProtocolError);
    return;
  }
  if (const auto accepted = seat.live->accept(seat.batch); !accepted) {
    seat.batch.poses.clear();
    refuse(client, accepted.error().message, accepted.error().code == ErrorCode::Limit ? kPolicy : kProtocolError);
    return;
  }
  measureArrival(seat);
}

void DrillLoop::measureArrival(Seat& seat) {
  const std::uint64_t t_us = seat.batch.poses.back().t_us;
  const std::uint64_t passed_us = t_us - seat.arrived_t_us;
  constexpr std::uint64_t kPause_us = 100'000;
  if (seat.arrived_t_us != 0 && t_us >= seat.arrived_t_us && passed_us < kPause_us) {
    const auto difference = (now_ - seat.arrived) - std::chrono::microseconds(passed_us);
    metrics_.jitter.add(difference < Clock::duration(0) ? -difference : difference);
  }
  seat.arrived = now_, seat.arrived_t_us = t_us;
}

void DrillLoop::onFinish(Client& client) {
  Seat& seat = *client.seat;
  seat.phase = Seat::Phase::Ending;
  tasks_.post([this, id = seat.id, live = seat.live] {
    const LiveDrill::Kept kept = live->keep(true);
    post([this, id, kept] { finished(id, kept); });
  });
}

void DrillLoop::finished(const std::string& id, const LiveDrill::Kept& kept) {
  const auto found = seats_.find(id);
  if (found == seats_.end()) return;
  Seat& seat = *found->second;
  for (Client* client : clientsOf(seat)) {
    if (kept.failed) {
      client->connection.send(wire::Refused{"the recording could not be kept"});
    } else if (client->kind != Client::Kind::New) {
      client->connection.send(wire::Finished{kept.recording_id, kept.metrics_json});
    }
    client->connection.close(kept.failed ? kInternalError : kNormal);
  }
  erase(id);
}

void DrillLoop::refuse(Client& client, const std::string& reason, std::uint16_t code) {
  client.connection.send(wire::Refused{reason});
  client.connection.close(code);
  leave(client);
  flush(client);
}

void DrillLoop::tellWatchers(Seat& seat, const wire::ServerMessage& message) {
  for (Client* watcher : std::vector<Client*>(seat.watchers)) {
    watcher->connection.send(message);
    flush(*watcher);
  }
}

/// The client has nothing to do with its session any more. What it sent in whole is drilled first.
void DrillLoop::leave(Client& client) {
  Seat* seat = std::exchange(client.seat, nullptr);
  const Client::Kind kind = std::exchange(client.kind, Client::Kind::Over);
  client.since = now_;
  if (!seat) return;
  if (kind == Client::Kind::Watcher) {
    std::erase(seat->watchers, &client);
    if (!seat->driver) return;
    seat->driver->connection.send(wire::SessionStatus{wire::StatusCode::WatcherLeft, "a watcher left"});
    flush(*seat->driver);
  }
  if (kind != Client::Kind::Driver) return;
  seat->driver = nullptr;
  seat->alone_since = now_;
  while (seat->isBusy()) drillSlice(*seat);
  tellWatchers(*seat, wire::SessionStatus{wire::StatusCode::Paused, "the trainee is away"});
}

/// Keeps what was drilled, marked incomplete, and closes who is there.
void DrillLoop::end(Seat& seat, const std::string& reason) {
  const bool ending = seat.phase == Seat::Phase::Ending;
  if (seat.live && !ending) tasks_.post([live = seat.live] { (void)live->keep(false); });
  for (Client* client : clientsOf(seat)) {
    if (!reason.empty()) client->connection.send(wire::Refused{reason});
    client->connection.close(kGoingAway);
  }
  erase(seat.id);
}

std::vector<DrillLoop::Client*> DrillLoop::clientsOf(const Seat& seat) const {
  std::vector<Client*> all;
  for (const auto& [socket, client] : clients_) {
    if (client->seat == &seat) all.push_back(client.get());
  }
  return all;
}

/// The session is no more; its connections, if any are left, only close.
void DrillLoop::erase(const std::string& id) {
  const auto found = seats_.find(id);
  if (found == seats_.end()) return;
  const std::vector<Client*> all = clientsOf(*found->second);
  ended_.push_back(std::move(found->second));
  seats_.erase(found);
  gone_(id);
  for (Client* client : all) {
    client->seat = nullptr, client->kind = Client::Kind::Over, client->since = now_;
    client->connection.close(kGoingAway);  // does nothing to one that closes already
    serve(*client);                        // the other side's close may have come
  }
}

}  // namespace spinaltap::ws
