// server/load/own_server.h - a server of our own as a child process, with a block of bone to drill, gone when we are.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <memory>

#include "server/load/load.h"

namespace spinaltap::load {

class OwnServer {
 public:
  /// Makes a case (a half-space of bone, the report's path in it) in a temporary folder and serves it on loopback.
  /// @cost a second. @error Io.
  [[nodiscard]] static Result<std::unique_ptr<OwnServer>> start(bool realtime);
  OwnServer(const OwnServer&) = delete;
  OwnServer& operator=(const OwnServer&) = delete;
  ~OwnServer();

  [[nodiscard]] const Target& target() const { return target_; }
  /// What it said of real time; empty when that was not asked for.
  [[nodiscard]] const std::string& realtimeLine() const { return realtime_line_; }
  /// Processor time that it used so far, s. 0 when the system does not say.
  [[nodiscard]] double cpu_s() const;
  /// Memory that it holds, KiB. 0 when the system does not say.
  [[nodiscard]] long memory_KiB() const;

 private:
  OwnServer() = default;
  [[nodiscard]] Result<void> launch(bool realtime);

  std::filesystem::path folder_;
  Target target_;
  pid_t process_ = -1;
  std::string realtime_line_;
};

}  // namespace spinaltap::load
