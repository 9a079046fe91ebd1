// The turns of the loop: who may read, drill and write next. What messages mean is drill_loop_protocol.cpp.
#include "server/ws/drill_loop.h"

#include <pthread.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "server/ws/drill_loop_parts.h"

namespace spinaltap::ws {
namespace {

constexpr auto kHousekeeping = std::chrono::milliseconds(100);
constexpr auto kHelloTime = std::chrono::seconds(30);
constexpr auto kPingAfter = std::chrono::seconds(20), kSilence = std::chrono::seconds(60);
constexpr auto kCloseTime = std::chrono::seconds(5), kGoodbyeTime = std::chrono::seconds(1);
constexpr auto kLate = std::chrono::milliseconds(1);
constexpr std::size_t kEvents = 128;

}  // namespace

DrillLoop::DrillLoop(store::Store& store, TaskThread& tasks, const LoopOptions& options,
                     std::function<void(const std::string&)> gone, int poll, int wake)
    : store_(store),
      tasks_(tasks),
      options_(options),
      gone_(std::move(gone)),
      poll_(poll),
      wake_(wake),
      realtime_(options.realtime),
      thread_([this] { run(); }) {}

Result<std::unique_ptr<DrillLoop>> DrillLoop::start(store::Store& store, TaskThread& tasks, const LoopOptions& options,
                                                    std::function<void(const std::string&)> gone) {
  const int poll = ::epoll_create1(EPOLL_CLOEXEC), wake = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.ptr = nullptr;
  if (poll < 0 || wake < 0 || ::epoll_ctl(poll, EPOLL_CTL_ADD, wake, &event) != 0) {
    return fail(ErrorCode::Io, std::string("cannot start a live loop: ") + std::strerror(errno));
  }
  return std::unique_ptr<DrillLoop>(new DrillLoop(store, tasks, options, std::move(gone), poll, wake));
}

DrillLoop::~DrillLoop() {
  stop();
  clients_.clear();
  ::close(poll_);
  ::close(wake_);
}

void DrillLoop::post(std::function<void()> task) {
  {
    const std::scoped_lock lock(posted_mutex_);
    posted_.push_back(std::move(task));
  }
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(wake_, &one, sizeof one);
}

void DrillLoop::stop() {
  if (!thread_.joinable()) return;
  post([this] { stopping_ = true; });
  thread_.join();
}

void DrillLoop::adopt(int socket, const std::string& id, const std::optional<Ticket>& first,
                      std::vector<std::byte> already_read) {
  post([this, socket, id, first, already_read = std::move(already_read)] {
    auto client = std::make_unique<Client>(socket, already_read, now_);  // owns the socket
    if (first && !stopping_) {
      auto seat = std::make_unique<Seat>();
      seat->id = id, seat->ticket = *first, seat->alone_since = now_;
      seats_.emplace(id, std::move(seat));
    }
    const auto seat = seats_.find(id);
    if (seat == seats_.end() || clients_.size() >= kMostClients) return;
    client->seat = seat->second.get();
    epoll_event event{};
    event.events = EPOLLIN | EPOLLOUT | EPOLLRDHUP | EPOLLET;
    event.data.ptr = client.get();
    if (::epoll_ctl(poll_, EPOLL_CTL_ADD, socket, &event) != 0) return;  // closes it
    Client& here = *(clients_[socket] = std::move(client));
    serve(here);
  });
}

void DrillLoop::runPosted() {
  std::uint64_t count = 0;
  [[maybe_unused]] const ssize_t got = ::read(wake_, &count, sizeof count);
  std::vector<std::function<void()>> tasks;
  {
    const std::scoped_lock lock(posted_mutex_);
    tasks.swap(posted_);
  }
  for (const auto& task : tasks) {
    try {
      task();
    } catch (const std::exception&) {
      continue;  // out of memory for one connection is no reason to end the others
    }
  }
}

void DrillLoop::run() {
  ::pthread_setname_np(::pthread_self(), "live drills");
  std::array<epoll_event, kEvents> events{};
  std::optional<Clock::time_point> until;
  for (;;) {
    const int wait_ms = !unread_.empty() ? 0 : !held_.empty() ? 1 : 100;
    const int count = ::epoll_wait(poll_, events.data(), kEvents, wait_ms);
    now_ = Clock::now();
    still_unread_.swap(unread_);
    for (int i = 0; i < count; ++i) {
      auto* client = static_cast<Client*>(events[static_cast<std::size_t>(i)].data.ptr);
      const std::uint32_t what = events[static_cast<std::size_t>(i)].events;
      if (!client) {
        runPosted();
        continue;
      }
      if (client->gone) continue;
      if ((what & EPOLLOUT) != 0) client->connection.writable();
      if ((what & (EPOLLIN | EPOLLRDHUP | EPOLLHUP | EPOLLERR)) != 0) client->connection.readable = true;
      serve(*client);
    }
    // those whose last turn was not enough; each has another
    for (std::size_t i = 0; i < still_unread_.size(); ++i) {
      Client* client = still_unread_[i];
      if (!client->gone && client->unread) serve(*client);
    }
    still_unread_.clear();
    const std::vector<Client*> held = std::exchange(held_, {});
    for (Client* client : held) {
      client->held = false;
      if (!client->gone) flush(*client);
    }
    if (now_ - checked_ >= kHousekeeping) housekeeping();
    if (stopping_ && !until) closeAll(), until = now_ + kGoodbyeTime;
    dropped_.clear();
    ended_.clear();
    if (until && (clients_.empty() || now_ > *until)) return;
  }
}

/// One client's turn: it reads, drills and answers, at most some poses of it.
void DrillLoop::serve(Client& client) {
  client.unread = false;
  std::size_t drilled = 0;
  const auto isDriver = [&client] { return client.kind == Client::Kind::Driver && client.seat; };
  while (!client.gone) {
    if (isDriver() && client.seat->isBusy()) {
      if (drilled >= kSlice) {
        client.unread = true;
        unread_.push_back(&client);
        break;
      }
      drilled += std::min(kSlice, client.seat->batch.poses.size() - client.seat->at);
      drillSlice(*client.seat);
      continue;
    }
    if (isDriver() && client.seat->phase != Seat::Phase::Live) break;  // until it is opened, or kept
    const FrameReader::Frame frame = client.deaf ? FrameReader::Frame{} : client.connection.frames.next();
    if (frame.got != FrameReader::Got::Nothing) {
      if (!onFrame(client, frame)) break;
      continue;
    }
    if (!client.connection.readable) {
      client.has_backlog = false;  // all that came is drilled
      break;
    }
    const Connection::Received received = client.deaf ? client.connection.discard() : client.connection.receive();
    if (received == Connection::Received::Nothing) continue;
    if (received == Connection::Received::Ended) {
      leave(client);
      drop(client.connection.socket());
      return;
    }
    client.heard = now_, client.pinged = false;
    if (!client.has_backlog) client.has_backlog = true, client.backlog_since = now_;
  }
  if (!client.gone) flush(client);
  if (isDriver() && client.seat->unanswered > 0) {
    const Clock::duration took = Clock::now() - client.backlog_since;
    metrics_.answer.add(took);
    if (took > kLate) metrics_.late += client.seat->unanswered;
    client.seat->unanswered = 0;
  }
}

void DrillLoop::drillSlice(Seat& seat) {
  const std::size_t to = std::min(seat.at + kSlice, seat.batch.poses.size()), count = to - seat.at;
  const Clock::time_point before = Clock::now();
  const auto drilled = seat.live->drill(seat.batch, seat.at, to, seat.feedback);
  metrics_.cycle.add((Clock::now() - before) / static_cast<int>(count), count);
  metrics_.cycles += count;
  seat.at = to;
  if (!drilled) {
    seat.batch.poses.clear(), seat.at = 0;
    end(seat, drilled.error().message);
    return;
  }
  if (!seat.isBusy()) answer(seat);
}

void DrillLoop::answer(Seat& seat) {
  if (seat.feedback.status != session::Status::Ok) ++metrics_.refused;
  if (seat.driver) {
    ++seat.unanswered;
    if (seat.driver->connection.send(seat.feedback, now_)) ++metrics_.coalesced;
  }
  for (Client* watcher : std::vector<Client*>(seat.watchers)) {
    watcher->connection.send(seat.feedback, now_);
    flush(*watcher);
  }
  seat.feedback = wire::Feedback{};
}

void DrillLoop::flush(Client& client) {
  if (client.gone) return;
  if (!client.connection.flush(now_)) {
    leave(client);
    drop(client.connection.socket());
    return;
  }
  if (client.connection.holdsFeedback() && !client.connection.stalledSince() && !client.held) {
    client.held = true;
    held_.push_back(&client);
  }
}

void DrillLoop::drop(int socket) {
  const auto found = clients_.find(socket);
  if (found == clients_.end()) return;
  ::epoll_ctl(poll_, EPOLL_CTL_DEL, socket, nullptr);
  Client* client = found->second.get();
  client->gone = true;
  std::erase(unread_, client);
  std::erase(held_, client);
  dropped_.push_back(std::move(found->second));
  clients_.erase(found);
}

void DrillLoop::checkClient(Client& client) {
  const Connection& connection = client.connection;
  const auto stalled = connection.stalledSince();
  const bool is_stalled = stalled && now_ - *stalled > options_.stall;
  const bool silent = now_ - client.heard > kSilence;
  const bool closed = connection.isClosing() && now_ - client.since > kCloseTime;
  if (is_stalled) ++metrics_.cut_loose;
  if (is_stalled || silent || closed) {
    leave(client);
    drop(connection.socket());
    return;
  }
  if (client.kind == Client::Kind::New && now_ - client.since > kHelloTime) {
    refuse(client, "nothing was said for half a minute", kPolicy);
    return;
  }
  if (now_ - client.heard > kPingAfter && !client.pinged) {
    client.pinged = true;
    client.connection.ping();
    flush(client);
  }
  Seat* seat = client.kind == Client::Kind::Driver ? client.seat : nullptr;
  // Poses that come while the case is being read wait for it; the welcome comes before anything else.
  const bool live = seat && seat->phase == Seat::Phase::Live;
  const bool behind = live && client.has_backlog && now_ - client.backlog_since > options_.overload;
  if (seat && behind && !seat->overloaded) {
    ++metrics_.overloads;
    client.connection.send(wire::SessionStatus{wire::StatusCode::Overload, "poses come faster than they are drilled"});
  }
  if (seat) seat->overloaded = behind;
}

void DrillLoop::housekeeping() {
  checked_ = now_;
  std::vector<Client*> clients;
  for (const auto& [socket, client] : clients_) clients.push_back(client.get());
  for (Client* client : clients) {
    if (!client->gone) checkClient(*client);
  }
  std::vector<Seat*> late;
  for (const auto& [id, seat] : seats_) {
    const bool empty = seat->phase == Seat::Phase::Vacant || seat->phase == Seat::Phase::Live;
    if (empty && !seat->driver && now_ - seat->alone_since > options_.patience) late.push_back(seat.get());
  }
  for (Seat* seat : late) end(*seat, "the trainee did not come back");
  count();
}

void DrillLoop::count() {
  std::uint64_t live = 0, paused = 0, watching = 0, poses = 0, input = 0, feedback = 0, disk = 0;
  for (const auto& [id, seat] : seats_) {
    if (!seat->live) continue;
    ++(seat->driver ? live : paused);
    watching += seat->watchers.size();
    poses += seat->batch.poses.size() - seat->at;
    if (seat->phase == Seat::Phase::Live) disk += seat->live->waitingBytes();
  }
  for (const auto& [socket, client] : clients_) {
    input += client->connection.frames.waiting();
    feedback += client->connection.holdsFeedback() ? 1 : 0;
  }
  metrics_.live = live, metrics_.paused = paused, metrics_.watching = watching;
  metrics_.poses_waiting = poses, metrics_.input_bytes_waiting = input;
  metrics_.feedback_waiting = feedback, metrics_.disk_bytes_waiting = disk;
}

void DrillLoop::closeAll() {
  std::vector<Client*> clients;
  for (const auto& [socket, client] : clients_) clients.push_back(client.get());
  for (Client* client : clients) {
    client->connection.close(kGoingAway);
    leave(*client);
    flush(*client);
  }
  std::vector<Seat*> seats;
  for (const auto& [id, seat] : seats_) seats.push_back(seat.get());
  for (Seat* seat : seats) end(*seat, "");
}

}  // namespace spinaltap::ws
