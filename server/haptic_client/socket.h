// server/haptic_client/socket.h - a client's TCP socket.
#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace spinaltap::haptic_client {

/// Owns a connected TCP socket.
class Socket {
 public:
  explicit Socket(int handle = -1) : handle_(handle) {}
  Socket(Socket&& other) noexcept;
  Socket& operator=(Socket&& other) noexcept;
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket();
  [[nodiscard]] int handle() const { return handle_; }

 private:
  int handle_;
};

/// Where a server is.
struct Address {
  std::string host = "127.0.0.1";  ///< a name, or numbers; of IPv6 without brackets
  std::uint16_t port = 80;
  [[nodiscard]] std::string text() const;  ///< "host:port", as in a Host header
};

/// "http://HOST:PORT", with or without "http://", a slash behind it, or ":PORT" (80 then).
/// @error InvalidArgument, in one line that says what is wrong.
[[nodiscard]] Result<Address> parseAddress(const std::string& url);

/// Blocks, as do sends and receives, each for at most `patience`; sends at once what it is given (TCP_NODELAY).
/// @error Io, naming the address.
[[nodiscard]] Result<Socket> connectTo(const Address& address, std::chrono::milliseconds patience);

/// False when the other side is gone or takes nothing.
[[nodiscard]] bool sendAll(int socket, std::string_view bytes);

}  // namespace spinaltap::haptic_client
