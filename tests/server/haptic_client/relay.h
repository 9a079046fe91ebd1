// tests/server/haptic_client/relay.h - a network between client and server: passes bytes on, late if so told, and
// breaks when told.
#pragma once
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace spinaltap::test {

/// One thread; loopback.
class Relay {
 public:
  /// @param delay of each way.
  explicit Relay(int to_port, std::chrono::milliseconds delay = {}) : to_port_(to_port), delay_(delay) {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof address;
    if (::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        ::listen(listener_, 16) != 0 || ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
      std::abort();
    }
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { run(); });
  }
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;
  ~Relay() {
    ending_ = true;
    thread_.join();
    ::close(listener_);
  }
  [[nodiscard]] int port() const { return port_; }
  /// Ends every connection of now, whatever is under way in it.
  void cut() { cut_ = true; }
  /// Until then new ones are ended at once.
  void refuse(bool refuse) { refuse_ = refuse; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Late {
    Clock::time_point due;
    std::string bytes;
  };
  struct Way {
    int from, to;
    std::deque<Late> under_way = {};
    bool ended = false;
  };
  struct Pair {
    Way there, back;
  };

  static sockaddr_in loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }
  void run() {
    while (!ending_) {
      std::vector<pollfd> polled{{listener_, POLLIN, 0}};
      for (const Pair& pair : pairs_) {
        for (const Way* way : {&pair.there, &pair.back}) {
          polled.push_back({way->ended ? -1 : way->from, POLLIN, 0});
        }
      }
      ::poll(polled.data(), polled.size(), 1);
      if (cut_.exchange(false)) drop([](const Pair&) { return true; });
      if ((polled[0].revents & POLLIN) != 0) accept();
      for (Pair& pair : pairs_) pass(pair.there), pass(pair.back);
      drop([](const Pair& pair) {
        return (pair.there.ended && pair.there.under_way.empty()) || (pair.back.ended && pair.back.under_way.empty());
      });
    }
    drop([](const Pair&) { return true; });
  }
  void accept() {
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    const int server = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_in address = loopback(to_port_);
    if (refuse_ || ::connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      ::close(client);
      ::close(server);
      return;
    }
    pairs_.push_back({{client, server}, {server, client}});
  }
  void pass(Way& way) {
    std::array<char, 65536> buffer;
    for (ssize_t n = 0; !way.ended && (n = ::recv(way.from, buffer.data(), buffer.size(), MSG_DONTWAIT)) >= 0;) {
      way.ended = n == 0;
      way.under_way.push_back({Clock::now() + delay_, {buffer.data(), static_cast<std::size_t>(n)}});
    }
    while (!way.under_way.empty() && way.under_way.front().due <= Clock::now()) {
      std::string& bytes = way.under_way.front().bytes;
      const ssize_t n = ::send(way.to, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (n > 0) bytes.erase(0, static_cast<std::size_t>(n));
      if (!bytes.empty()) break;  // it takes no more now
      way.under_way.pop_front();
    }
  }
  template <class Which>
  void drop(const Which& which) {
    pairs_.remove_if([&](const Pair& pair) {
      if (!which(pair)) return false;
      ::close(pair.there.from);
      ::close(pair.there.to);
      return true;
    });
  }

  int to_port_, listener_, port_ = 0;
  std::chrono::milliseconds delay_;
  std::list<Pair> pairs_;
  std::atomic<bool> ending_ = false, cut_ = false, refuse_ = false;
  std::thread thread_;
};

}  // namespace spinaltap::test
