// server/load/echo.h - the least that any server must do: read a pose's bytes, write as many as a feedback has.
#pragma once
#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "server/haptic_client/line.h"

namespace spinaltap::load {

/// A thread with epoll and nothing else. Lines from connect() speak to it as to a server.
class Echo {
 public:
  Echo();
  Echo(const Echo&) = delete;
  Echo& operator=(const Echo&) = delete;
  ~Echo();
  /// @error Io.
  [[nodiscard]] Result<haptic_client::Line> connect();

 private:
  struct Peer;
  void run();
  void answer(Peer& peer);

  int listener_ = -1, poll_ = -1;
  std::uint16_t port_ = 0;
  std::vector<std::unique_ptr<Peer>> peers_;
  std::atomic<bool> ending_ = false;
  std::thread thread_;
};

}  // namespace spinaltap::load
