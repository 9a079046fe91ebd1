#include "server/haptic_client/socket.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <utility>

namespace spinaltap::haptic_client {
namespace {

tl::unexpected<Error> badUrl(const std::string& url, const char* what) {
  return fail(ErrorCode::InvalidArgument, "'" + url + "' is no server's address (http://HOST:PORT): " + what);
}

Result<std::uint16_t> parsePort(const std::string& url, std::string_view text) {
  unsigned port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  const bool whole = error == std::errc() && end == text.data() + text.size() && !text.empty();
  if (!whole || port < 1 || port > 65535) return badUrl(url, "a port is 1 to 65535");
  return static_cast<std::uint16_t>(port);
}

using Addresses = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

Result<Addresses> resolve(const Address& address) {
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failed = ::getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &wanted, &found);
  if (failed != 0) return fail(ErrorCode::Io, "cannot find " + address.host + ": " + ::gai_strerror(failed));
  return Addresses(found, &::freeaddrinfo);
}

}  // namespace

Socket::Socket(Socket&& other) noexcept : handle_(std::exchange(other.handle_, -1)) {}
Socket& Socket::operator=(Socket&& other) noexcept {
  std::swap(handle_, other.handle_);
  return *this;
}
Socket::~Socket() {
  if (handle_ >= 0) ::close(handle_);
}

std::string Address::text() const {
  const bool six = host.find(':') != std::string::npos;
  return (six ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

Result<Address> parseAddress(const std::string& url) {
  std::string_view rest = url;
  if (const auto scheme = rest.find("://"); scheme != std::string_view::npos) {
    if (rest.substr(0, scheme) != "http") return badUrl(url, "http is what this program speaks");
    rest.remove_prefix(scheme + 3);
  }
  if (!rest.empty() && rest.back() == '/') rest.remove_suffix(1);
  if (rest.find('/') != std::string_view::npos) return badUrl(url, "nothing follows the port");
  Address address;
  const bool six = !rest.empty() && rest.front() == '[';
  const auto end = six ? rest.find(']') : rest.find(':');
  if (six && end == std::string_view::npos) return badUrl(url, "a bracket is open");
  address.host = six ? rest.substr(1, end - 1) : rest.substr(0, end);
  const std::string_view after = end == std::string_view::npos ? "" : rest.substr(end + (six ? 1 : 0));
  for (const char c : address.host) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (!plain && c != '.' && c != '-' && c != '_' && !(six && (c == ':' || c == '%'))) {
      return badUrl(url, "what stands there is no host");
    }
  }
  if (address.host.empty()) return badUrl(url, "the host is missing");
  if (after.empty()) return address;
  if (after.front() != ':') return badUrl(url, "what stands there is no port");
  const auto port = parsePort(url, after.substr(1));
  if (!port) return tl::unexpected(port.error());
  address.port = *port;
  return address;
}

Result<Socket> connectTo(const Address& address, std::chrono::milliseconds patience) {
  const auto found = resolve(address);
  if (!found) return tl::unexpected(found.error());
  int why = 0;
  for (const addrinfo* at = found->get(); at != nullptr; at = at->ai_next) {
    Socket socket(::socket(at->ai_family, at->ai_socktype | SOCK_CLOEXEC, at->ai_protocol));
    const timeval limit{patience.count() / 1000, (patience.count() % 1000) * 1000};
    const int yes = 1;
    ::setsockopt(socket.handle(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    ::setsockopt(socket.handle(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    ::setsockopt(socket.handle(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    if (::connect(socket.handle(), at->ai_addr, at->ai_addrlen) == 0) return socket;
    why = errno == EINPROGRESS ? ETIMEDOUT : errno;
  }
  return fail(ErrorCode::Io, "no server at " + address.text() + ": " + std::strerror(why));
}

bool sendAll(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

}  // namespace spinaltap::haptic_client
