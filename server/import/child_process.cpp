#include "server/import/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>

#include "server/import/protocol.h"
#include "server/import/sanitized.h"

namespace spinaltap::importer {

namespace {

using Clock = std::chrono::steady_clock;

class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() { close(); }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool open() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

struct Pipe {
  Descriptor read, write;
};

Result<Pipe> makePipe() {
  std::array<int, 2> fds{};
  if (pipe2(fds.data(), O_CLOEXEC) != 0) return fail(ErrorCode::Io, "no pipe for the importer");
  return Pipe{Descriptor(fds[0]), Descriptor(fds[1])};
}

struct Pipes {
  Pipe input, output, progress;
};

Result<Pipes> makePipes() {
  auto input = makePipe();
  if (!input) return tl::unexpected(input.error());
  auto output = makePipe();
  if (!output) return tl::unexpected(output.error());
  auto progress = makePipe();
  if (!progress) return tl::unexpected(progress.error());
  return Pipes{std::move(*input), std::move(*output), std::move(*progress)};
}

/// What the child finds: three pipes, nothing else open, no signal blocked or ignored, a process group of its own.
class SpawnPlan {
 public:
  SpawnPlan(int in, int out, int progress) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_adddup2(&actions_, in, STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions_, out, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions_, progress, kProgressDescriptor);
#if !SPINALTAP_SANITIZED
    // Parsers print header text to stderr, and header text may name a person. (A sanitizer's report is worth more.)
    posix_spawn_file_actions_addopen(&actions_, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
#endif
    posix_spawn_file_actions_addclosefrom_np(&actions_, kProgressDescriptor + 1);

    sigset_t all, none;
    sigfillset(&all);
    sigemptyset(&none);
    posix_spawnattr_init(&attributes_);
    posix_spawnattr_setsigdefault(&attributes_, &all);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setpgroup(&attributes_, 0);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  }
  SpawnPlan(const SpawnPlan&) = delete;
  SpawnPlan& operator=(const SpawnPlan&) = delete;
  ~SpawnPlan() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }

  /// -1 when it cannot be started.
  [[nodiscard]] pid_t run(const std::filesystem::path& program, const std::vector<std::string>& arguments) const {
    std::vector<std::string> words{"spinaltap-import"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    argv.reserve(words.size() + 1);
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    std::array<char*, 1> environment{nullptr};
    pid_t child = -1;
    const int error = posix_spawn(&child, program.c_str(), &actions_, &attributes_, argv.data(), environment.data());
    return error == 0 ? child : -1;
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

Result<pid_t> start(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                    const Pipes& pipes) {
  // A pipe end may itself be descriptor 0 to 3; dup2 onto itself would keep close-on-exec, and one dup2 could close
  // another's source. Moving them all above 9 first settles both.
  const Descriptor in(fcntl(pipes.input.read.get(), F_DUPFD_CLOEXEC, 10));
  const Descriptor out(fcntl(pipes.output.write.get(), F_DUPFD_CLOEXEC, 10));
  const Descriptor progress(fcntl(pipes.progress.write.get(), F_DUPFD_CLOEXEC, 10));
  if (!in.open() || !out.open() || !progress.open()) return fail(ErrorCode::Io, "no pipe for the importer");
  const pid_t child = SpawnPlan(in.get(), out.get(), progress.get()).run(program, arguments);
  if (child < 0) return fail(ErrorCode::Io, "cannot start spinaltap-import beside the program");
  return child;
}

/// True while the pipe stays open.
template <class Take>
bool drain(Descriptor& pipe, std::span<std::byte> buffer, const Take& take) {
  const ssize_t got = read(pipe.get(), buffer.data(), buffer.size());
  if (got < 0 && errno == EINTR) return true;
  if (got <= 0) {
    pipe.close();
    return false;
  }
  take(buffer.first(static_cast<std::size_t>(got)));
  return true;
}

class LineSplitter {
 public:
  explicit LineSplitter(const std::function<void(const std::string&)>& sink) : sink_(sink) {}
  void operator()(std::span<const std::byte> bytes) {
    for (const std::byte b : bytes) {
      if (static_cast<char>(b) != '\n') {
        if (line_.size() < kLongest) line_.push_back(static_cast<char>(b));
        continue;
      }
      if (sink_) sink_(line_);
      line_.clear();
    }
  }

 private:
  static constexpr std::size_t kLongest = 1000;
  const std::function<void(const std::string&)>& sink_;
  std::string line_;
};

void pump(Pipes& pipes, Clock::time_point end, const ChildStreams& streams, ChildEnd& result) {
  std::vector<std::byte> buffer(std::size_t{1} << 18);
  LineSplitter lines(streams.progress_line);
  while (pipes.output.read.open() || pipes.progress.read.open()) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0) {
      result.timed_out = true;
      return;
    }
    std::array<pollfd, 2> waiting{pollfd{pipes.output.read.get(), POLLIN, 0}, {pipes.progress.read.get(), POLLIN, 0}};
    if (poll(waiting.data(), waiting.size(), static_cast<int>(std::min<long long>(left, 1000))) < 0) continue;
    if (waiting[1].revents != 0) {
      drain(pipes.progress.read, buffer, [&](std::span<const std::byte> bytes) { lines(bytes); });
    }
    if (waiting[0].revents == 0) continue;
    bool go_on = true;
    drain(pipes.output.read, buffer, [&](std::span<const std::byte> bytes) { go_on = streams.output(bytes); });
    if (!go_on) {
      result.stopped_early = true;
      return;
    }
  }
}

/// Small enough for the pipe's buffer, so that this cannot block; SIGPIPE cannot come, since the read end is still
/// ours.
Result<void> sendInput(Pipes& pipes, std::span<const std::byte> input) {
  fcntl(pipes.input.write.get(), F_SETFL, O_NONBLOCK);
  const ssize_t sent = write(pipes.input.write.get(), input.data(), input.size());
  pipes.input.write.close();
  if (sent != static_cast<ssize_t>(input.size())) return fail(ErrorCode::Io, "the importer does not listen");
  return {};
}

/// Waits until the deadline for a child that closed its pipes but lives on.
void reap(pid_t child, Clock::time_point end, ChildEnd& result) {
  int status = 0;
  rusage usage{};
  if (result.timed_out || result.stopped_early) kill(child, SIGKILL);
  while (true) {
    const pid_t got = wait4(child, &status, result.timed_out || result.stopped_early ? 0 : WNOHANG, &usage);
    if (got == child) break;
    if (got < 0 && errno != EINTR) break;
    if (got == 0) {
      if (Clock::now() >= end) {
        result.timed_out = true;
        kill(child, SIGKILL);
      } else {
        usleep(500);
      }
    }
  }
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  result.max_resident_kib = usage.ru_maxrss;
}

}  // namespace

Result<ChildEnd> runChild(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                          std::span<const std::byte> input, std::chrono::milliseconds deadline,
                          const ChildStreams& streams) {
  auto pipes = makePipes();
  if (!pipes) return tl::unexpected(pipes.error());
  const Clock::time_point end = Clock::now() + deadline;
  if (auto sent = sendInput(*pipes, input); !sent) return tl::unexpected(sent.error());
  auto child = start(program, arguments, *pipes);
  if (!child) return tl::unexpected(child.error());
  pipes->input.read.close();
  pipes->output.write.close();
  pipes->progress.write.close();
  ChildEnd result;
  pump(*pipes, end, streams, result);
  reap(*child, end, result);
  return result;
}

std::filesystem::path defaultChildProgram() {
  std::error_code ignored;
  return std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path() / "spinaltap-import";
}

}  // namespace spinaltap::importer
