// tests/server/program.h - the real program as a child process: run to its end, or served until told to stop.
#pragma once
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace spinaltap::test {

using Json = nlohmann::ordered_json;

struct Child {
  pid_t id = -1;
  int out = -1, err = -1;
};

/// Starts SPINALTAP_PROGRAM (a compile definition) with these arguments and no terminal.
inline Child start(const std::vector<std::string>& arguments) {
  std::array<int, 2> out{}, err{};
  if (::pipe2(out.data(), O_CLOEXEC) != 0 || ::pipe2(err.data(), O_CLOEXEC) != 0) std::abort();
  std::vector<char*> argv{const_cast<char*>(SPINALTAP_PROGRAM)};
  for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t id = ::fork();
  if (id == 0) {
    ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
    ::dup2(out[1], STDOUT_FILENO);
    ::dup2(err[1], STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(out[1]);
  ::close(err[1]);
  return {id, out[0], err[0]};
}

struct Finished {
  int code = -1;  ///< exit code; 128 + signal when killed
  std::string out, err;

  /// Standard output as the one JSON object that it must be.
  [[nodiscard]] Json json() const {
    const auto newline = out.find('\n');
    if (newline == std::string::npos || newline + 1 != out.size()) return Json(Json::value_t::discarded);
    return Json::parse(out, nullptr, false);
  }
};

inline int waitFor(pid_t id) {
  int status = 0;
  ::waitpid(id, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

inline Finished run(const std::vector<std::string>& arguments) {
  const Child child = start(arguments);
  Finished finished;
  std::array<pollfd, 2> polled{{{child.out, POLLIN, 0}, {child.err, POLLIN, 0}}};
  while (polled[0].fd >= 0 || polled[1].fd >= 0) {
    ::poll(polled.data(), 2, -1);
    for (std::size_t i = 0; i < 2; ++i) {
      if (polled[i].revents == 0) continue;
      std::array<char, 4096> buffer{};
      const ssize_t n = ::read(polled[i].fd, buffer.data(), buffer.size());
      if (n > 0) (i == 0 ? finished.out : finished.err).append(buffer.data(), static_cast<std::size_t>(n));
      if (n <= 0) polled[i].fd = -1;
    }
  }
  ::close(child.out);
  ::close(child.err);
  finished.code = waitFor(child.id);
  return finished;
}

/// `spinaltap serve` on a free port of loopback.
class Server {
 public:
  explicit Server(const std::string& data, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"serve", "--data", data, "--port", "0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    child_ = start(arguments);
    char c = 0;
    while (::read(child_.out, &c, 1) == 1 && c != '\n') line_ += c;
    const auto colon = line_.rfind(':');
    if (colon != std::string::npos) port_ = std::atoi(line_.c_str() + colon + 1);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  ~Server() {
    if (child_.id > 0) end(SIGKILL);
    ::close(child_.out);
    ::close(child_.err);
  }
  /// The exit code.
  int end(int signal = SIGTERM) {
    ::kill(child_.id, signal);
    const int code = waitFor(child_.id);
    child_.id = -1;
    return code;
  }
  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] pid_t id() const { return child_.id; }
  [[nodiscard]] const std::string& line() const { return line_; }

 private:
  Child child_;
  std::string line_;
  int port_ = 0;
};

}  // namespace spinaltap::test
