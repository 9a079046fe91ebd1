// A line to servers that tests play.
#include "server/haptic_client/line.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <thread>

namespace spinaltap::haptic_client {
namespace {
using std::chrono::seconds;

/// Takes one WebSocket, answers its handshake and then says what it was given, whatever comes.
class PlayedServer {
 public:
  explicit PlayedServer(std::string says, std::string head = kSwitching) {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(listener_, 1), 0);
    EXPECT_EQ(::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    address_.port = ntohs(address.sin_port);
    thread_ = std::thread([this, text = head + says] {
      const Socket client(::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC));
      std::string asked;
      std::array<char, 1024> some{};
      while (asked.find("\r\n\r\n") == std::string::npos) {
        const ssize_t n = ::recv(client.handle(), some.data(), some.size(), 0);
        if (n <= 0) return;
        asked.append(some.data(), static_cast<std::size_t>(n));
      }
      std::ignore = sendAll(client.handle(), text);
      while (::recv(client.handle(), some.data(), some.size(), 0) > 0) {
      }
    });
  }
  PlayedServer(const PlayedServer&) = delete;
  PlayedServer& operator=(const PlayedServer&) = delete;
  ~PlayedServer() {
    thread_.join();
    ::close(listener_);
  }
  [[nodiscard]] const Address& address() const { return address_; }
  static constexpr const char* kSwitching =
      "HTTP/1.1 101 Switching Protocols\r\nSec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n\r\n";

 private:
  int listener_ = -1;
  Address address_;
  std::thread thread_;
};

std::string framed(const wire::ServerMessage& message) {
  wire::ByteWriter out;
  ws::writeFrame(out, ws::Opcode::Binary, wire::encode(message), ws::Side::Server);
  return {reinterpret_cast<const char*>(out.bytes().data()), out.bytes().size()};
}

TEST(Line, FindsTheWelcomeBehindOtherNewsAndKeepsWhatCameWithIt) {
  wire::Welcome welcome;
  welcome.next_seq = 43;
  wire::Feedback feedback;
  feedback.seq = 42;
  PlayedServer server(framed(wire::SessionStatus{wire::StatusCode::Overload, "busy"}) + framed(welcome) +
                      framed(feedback));
  auto line = Line::open(server.address(), "s1", {}, seconds(30)).value();
  EXPECT_EQ(line.welcome().next_seq, 43u);
  std::size_t bytes = 0;
  while (bytes == 0 && line.receive([&](std::span<const std::byte> message) { bytes = message.size(); })) {
  }
  EXPECT_EQ(bytes, wire::kFeedbackBytes);
}

TEST(Line, SaysWhyItCouldNotBeOpened) {
  const auto messageOf = [](const std::string& says, const std::string& head = PlayedServer::kSwitching) {
    PlayedServer server(says, head);
    const auto line = Line::open(server.address(), "s1", {}, seconds(30));
    EXPECT_FALSE(line.has_value());
    std::string message = line ? "" : line.error().message;
    if (const auto at = message.find(server.address().text()); at != std::string::npos) message.resize(at);
    return message;
  };
  EXPECT_EQ(messageOf(framed(wire::Refused{"somebody drives this session"})), "somebody drives this session");
  EXPECT_EQ(messageOf(framed(wire::Feedback{})), "the server's first message is no welcome");
  EXPECT_EQ(messageOf(std::string("\x88\x02\x03\xe8", 4)), "the server closed the line");
  EXPECT_EQ(messageOf("", "HTTP/1.1 404 Not Found\r\n\r\n"), "the server knows this session no more");
  EXPECT_EQ(messageOf("", "HTTP/1.1 503 Busy\r\n\r\n"), "the server answered 503");
  EXPECT_EQ(messageOf("", "HTTP/1.1 101 Switching Protocols\r\n\r\n"), "what is at ");  // no WebSocket
  EXPECT_EQ(messageOf("", "SSH-2.0-other\r\n\r\n"), "what is at ");
}

}  // namespace
}  // namespace spinaltap::haptic_client
