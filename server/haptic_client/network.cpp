#include "server/haptic_client/network.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>

namespace spinaltap::haptic_client {
namespace {
using std::chrono::milliseconds;

constexpr milliseconds kTurn{50};  // between looks at what is asked of the thread
constexpr milliseconds kFirstPause{20}, kLongestPause{1000};
constexpr std::size_t kMostInABatch = 64;

}  // namespace

Result<std::unique_ptr<Network>> Network::start(const NetworkSetup& setup) {
  auto line = Line::open(setup.server, setup.session, setup.hello, setup.patience);
  if (!line) return tl::unexpected(line.error());
  if (!(line->welcome().stiffness_N_mm > 0)) return fail(ErrorCode::Unsupported, "the server holds the bit rigidly");
  const int wake = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (wake < 0) return fail(ErrorCode::Io, "no handles left");
  std::unique_ptr<Network> made(new Network(setup, std::move(*line), wake));
  made->thread_ = std::thread([network = made.get()] { network->run(); });
  return made;
}

Network::Network(const NetworkSetup& setup, Line line, int wake)
    : setup_(setup), wake_(wake), welcome_(line.welcome()), line_(std::move(line)) {
  setup_.hello.resumes = true, setup_.hello.token = welcome_.token;  // from here on
  round_trips_us_.reserve(1 << 16);
  batch_.reserve(kMostInABatch);
}

Network::~Network() {
  stopping_ = true;
  wakeUp();
  if (thread_.joinable()) thread_.join();
  ::close(wake_);
}

void Network::send(std::uint32_t seq, const session::Input& pose) {
  if (!poses_.push({seq, pose, Clock::now()})) overrun_ = true;
  wakeUp();
}

void Network::wakeUp() const {
  const std::uint64_t one = 1;
  (void)!::write(wake_, &one, sizeof one);
}

void Network::tell() {
  const std::lock_guard lock(mutex_);
  told_.notify_all();
}

void Network::waitForAnswer(std::uint32_t seq, std::uint32_t resumed, const std::atomic<bool>& stopping) {
  std::unique_lock lock(mutex_);
  told_.wait(lock, [&] {
    return static_cast<std::int32_t>(answered_ - seq) > 0 || resumed_ != resumed || ended_ || stopping;
  });
}

Error Network::error() const {
  const std::lock_guard lock(mutex_);
  return error_;
}

void Network::end(Error error) {
  {
    const std::lock_guard lock(mutex_);
    if (!ended_) error_ = std::move(error);
    ended_ = true;
  }
  told_.notify_all();
}

Result<wire::Finished> Network::finish(milliseconds patience) {
  finishing_ = true;
  wakeUp();
  std::unique_lock lock(mutex_);
  const bool told = told_.wait_for(lock, patience, [&] { return finished_ || ended_; });
  if (finished_) return *finished_;
  if (!told) return fail(ErrorCode::Io, "the server did not complete the recording in time");
  return tl::unexpected(error_);
}

void Network::run() {
  while (!stopping_ && !ended_) {
    gather();
    const bool alive = sendWaiting() && receive();
    if (ended_) break;
    if (!alive) {
      resume();
      continue;
    }
    wait(kTurn);
  }
}

void Network::wait(milliseconds most) {
  std::array<pollfd, 2> polled{{{wake_, POLLIN, 0}, {line_.handle(), POLLIN, 0}}};
  if (line_.hasUnsent()) polled[1].events |= POLLOUT;
  ::poll(polled.data(), broken_ ? 1 : 2, static_cast<int>(most.count()));
  std::uint64_t count = 0;
  (void)!::read(wake_, &count, sizeof count);
}

void Network::gather() {
  for (Pose pose; poses_.pop(pose);) unanswered_.push_back(pose);
  if (overrun_) end({ErrorCode::Limit, "the device sends faster than this machine can pass on"});
  if (late_ && answers_.push(*late_)) late_.reset();
}

/// False when the line is broken.
bool Network::sendWaiting() {
  if (!line_.flush()) return false;
  while (handed_over_ < unanswered_.size() && !line_.hasUnsent()) {
    const std::size_t count = std::min(kMostInABatch, unanswered_.size() - handed_over_);
    batch_.clear();
    for (std::size_t i = 0; i < count; ++i) batch_.push_back(unanswered_[handed_over_ + i].input);
    const std::uint32_t first = unanswered_[handed_over_].seq;
    handed_over_ += count;
    if (!line_.send(first, batch_)) return false;
  }
  if (!finishing_ || finish_sent_ || handed_over_ < unanswered_.size()) return true;
  finish_sent_ = true;
  return line_.sendFinish();
}

bool Network::receive() {
  return line_.receive([this](std::span<const std::byte> bytes) { onMessage(bytes); });
}

void Network::onMessage(std::span<const std::byte> bytes) {
  const auto message = wire::decodeServerMessage(bytes);
  if (!message) {
    end({ErrorCode::Corrupt, "the server's answer: " + message.error().message});
  } else if (const auto* feedback = std::get_if<wire::Feedback>(&*message)) {
    onFeedback(*feedback);
  } else if (const auto* refused = std::get_if<wire::Refused>(&*message)) {
    end({ErrorCode::Limit, "the server ended the drill: " + refused->reason});
  } else if (const auto* finished = std::get_if<wire::Finished>(&*message)) {
    {
      const std::lock_guard lock(mutex_);
      finished_ = *finished;
    }
    end({ErrorCode::Io, "the drill is over"});
  }
}

void Network::onFeedback(const wire::Feedback& feedback) {
  Answer answer{feedback, 0};
  while (!unanswered_.empty() && static_cast<std::int32_t>(feedback.seq - unanswered_.front().seq) >= 0) {
    if (unanswered_.front().seq == feedback.seq) {
      const auto took = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - unanswered_.front().at);
      answer.round_trip_us = static_cast<std::uint32_t>(std::clamp<std::int64_t>(took.count(), 0, UINT32_MAX));
      if (round_trips_us_.size() < kMostRoundTrips) round_trips_us_.push_back(answer.round_trip_us);
    }
    unanswered_.pop_front();
    handed_over_ -= handed_over_ > 0 ? 1 : 0;
  }
  late_.reset();
  if (!answers_.push(answer)) late_ = answer;
  answered_ = feedback.seq + 1;
  tell();
}

/// What the server has already is not sent again; it is in the state, answered or not.
void Network::dropTaken(std::uint32_t next_seq) {
  while (!unanswered_.empty() && static_cast<std::int32_t>(next_seq - unanswered_.front().seq) > 0) {
    unanswered_.pop_front();
  }
  handed_over_ = 0;
}

/// Until the line is back, or there is no hope.
void Network::resume() {
  if (finish_sent_) return end({ErrorCode::Io, "the line broke while the server was completing the recording"});
  broken_ = true;
  const Clock::time_point since = Clock::now();
  milliseconds pause = kFirstPause;
  Error why{ErrorCode::Io, "the line broke"};
  while (!stopping_ && Clock::now() - since < setup_.resume_for) {
    auto line = Line::open(setup_.server, setup_.session, setup_.hello, setup_.patience);
    if (line) {
      line_ = std::move(*line);
      dropTaken(line_.welcome().next_seq);
      broken_ = false;
      ++resumed_;
      return tell();
    }
    why = line.error();
    if (why.code != ErrorCode::Io) break;
    for (const auto until = Clock::now() + pause; !stopping_ && Clock::now() < until;) {
      wait(std::chrono::ceil<milliseconds>(until - Clock::now()));
      gather();  // the device may still be sending
    }
    pause = std::min(2 * pause, kLongestPause);
  }
  end({why.code, "the line broke and could not be resumed: " + why.message});
}

}  // namespace spinaltap::haptic_client
