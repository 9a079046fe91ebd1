// tests/server/sockets.h - a small HTTP and WebSocket client on raw sockets, so that tests can also break the rules.
#pragma once
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace spinaltap::test {

/// A blocking connection to loopback that gives up after ten seconds.
class Connection {
 public:
  /// @param window  bytes that may wait here unread; 0 leaves it to the system.
  explicit Connection(int port, int window = 0) : handle_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const timeval limit{10, 0};
    ::setsockopt(handle_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    ::setsockopt(handle_, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    if (window > 0) ::setsockopt(handle_, SOL_SOCKET, SO_RCVBUF, &window, sizeof window);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    open_ = ::connect(handle_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  /// One end of a pair, with the same patience.
  struct Pair {
    int handle;
  };
  explicit Connection(Pair end) : handle_(end.handle), open_(true) {
    const timeval limit{10, 0};
    ::setsockopt(handle_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    ::setsockopt(handle_, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() { close(); }
  void close() {
    if (handle_ >= 0) ::close(handle_);
    handle_ = -1;
  }
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n = ::send(handle_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (n <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }
  /// Exactly so many bytes; fewer when the other side ends or ten seconds pass.
  std::string receive(std::size_t size) {
    while (pending_.size() < size && more()) {
    }
    std::string bytes = pending_.substr(0, size);
    pending_.erase(0, bytes.size());
    return bytes;
  }
  /// Up to and including `end`; empty when it does not come.
  std::string receiveUntil(const std::string& end) {
    std::size_t at = pending_.find(end);
    while (at == std::string::npos && more()) at = pending_.find(end);
    return at == std::string::npos ? std::string() : receive(at + end.size());
  }
  std::string receiveAll() {
    while (more()) {
    }
    return std::exchange(pending_, {});
  }
  [[nodiscard]] bool isOpen() const { return open_; }

 private:
  bool more() {
    std::array<char, 65536> buffer{};
    const ssize_t n = ::recv(handle_, buffer.data(), buffer.size(), 0);
    if (n > 0) pending_.append(buffer.data(), static_cast<std::size_t>(n));
    return n > 0;
  }
  int handle_;
  bool open_ = false;
  std::string pending_;
};

struct Reply {
  int status = 0;
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;
  [[nodiscard]] std::string header(const std::string& name) const {
    const auto found = headers.find(name);
    return found == headers.end() ? "" : found->second;
  }
  [[nodiscard]] nlohmann::json json() const { return nlohmann::json::parse(body, nullptr, false); }
};

inline Reply readReply(Connection& connection, bool has_body = true) {
  Reply reply;
  std::string head = connection.receiveUntil("\r\n\r\n");
  if (head.rfind("HTTP/1.1 ", 0) != 0) return reply;
  reply.status = std::atoi(head.c_str() + 9);
  std::size_t at = head.find("\r\n") + 2;
  for (std::size_t end = head.find("\r\n", at); end > at; end = head.find("\r\n", at)) {
    const std::string line = head.substr(at, end - at);
    std::string name = line.substr(0, line.find(':'));
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
    reply.headers[name] = line.substr(std::min(line.size(), line.find(':') + 2));
    at = end + 2;
  }
  if (has_body && reply.status != 304) {
    reply.body = connection.receive(static_cast<std::size_t>(std::atoll(reply.header("content-length").c_str())));
  }
  return reply;
}

struct Ask {
  std::string method = "GET", target = "/", body = {};
  std::vector<std::string> headers = {};  ///< "Name: value"
  std::string host = "127.0.0.1";
};

inline std::string requestText(const Ask& ask) {
  std::string text = ask.method + " " + ask.target + " HTTP/1.1\r\nHost: " + ask.host + "\r\n";
  for (const auto& header : ask.headers) text += header + "\r\n";
  if (!ask.body.empty()) text += "Content-Length: " + std::to_string(ask.body.size()) + "\r\n";
  return text + "\r\n" + ask.body;
}

inline Reply ask(int port, const Ask& what) {
  Connection connection(port);
  connection.send(requestText(what));
  return readReply(connection, what.method != "HEAD");
}
inline Reply get(int port, const std::string& target, std::vector<std::string> headers = {}) {
  return ask(port, {"GET", target, "", std::move(headers)});
}
inline Reply post(int port, const std::string& target, const nlohmann::json& body) {
  return ask(port, {"POST", target, body.dump(), {"Content-Type: application/json"}});
}

/// A WebSocket client that masks with zeros (allowed by RFC 6455, and easy to read in a debugger).
class WebSocket {
 public:
  WebSocket(int port, const std::string& target, const std::vector<std::string>& headers = {}, int window = 0)
      : connection_(port, window) {
    Ask upgrade{"GET", target, "", headers};
    for (const char* header : {"Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                               "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="}) {
      upgrade.headers.emplace_back(header);
    }
    connection_.send(requestText(upgrade));
    reply_ = readReply(connection_, false);
  }
  /// Without a handshake.
  explicit WebSocket(Connection::Pair end) : connection_(end) {}
  [[nodiscard]] const Reply& reply() const { return reply_; }

  static std::string frame(std::span<const std::byte> payload, unsigned opcode = 2) {
    std::string text(1, static_cast<char>(0x80u | opcode));
    const std::size_t size = payload.size();
    if (size < 126) {
      text += static_cast<char>(0x80u | size);
    } else {
      const bool wide = size > 0xffff;
      text += static_cast<char>(0x80u | (wide ? 127u : 126u));
      for (int shift = wide ? 56 : 8; shift >= 0; shift -= 8) text += static_cast<char>((size >> shift) & 0xff);
    }
    text.append(4, '\0');  // the mask
    text.append(reinterpret_cast<const char*>(payload.data()), size);
    return text;
  }
  bool send(std::span<const std::byte> payload, unsigned opcode = 2) {
    return connection_.send(frame(payload, opcode));
  }

  struct Frame {
    unsigned opcode = 0;  ///< 0 when the connection ended
    std::vector<std::byte> payload;
    [[nodiscard]] int closeCode() const {
      return opcode != 8 || payload.size() < 2 ? 0 : static_cast<int>(payload[0]) * 256 + static_cast<int>(payload[1]);
    }
  };
  Frame receive() {
    Frame frame;
    const std::string head = connection_.receive(2);
    if (head.size() < 2) return frame;
    frame.opcode = static_cast<unsigned char>(head[0]) & 15u;
    std::uint64_t size = static_cast<unsigned char>(head[1]) & 127u;
    if (size >= 126) {
      const std::string more = connection_.receive(size == 126 ? 2 : 8);
      size = 0;
      for (const char c : more) size = size * 256 + static_cast<unsigned char>(c);
    }
    const std::string payload = connection_.receive(size);
    const auto* data = reinterpret_cast<const std::byte*>(payload.data());
    frame.payload.assign(data, data + payload.size());
    return frame;
  }
  Connection& connection() { return connection_; }

 private:
  Connection connection_;
  Reply reply_;
};

}  // namespace spinaltap::test
