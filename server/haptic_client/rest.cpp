#include "server/haptic_client/rest.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace spinaltap::haptic_client {
namespace {
using nlohmann::json;

constexpr std::size_t kMostHeadBytes = 16 << 10, kMostBodyBytes = 4 << 20;
// The key and the answer to it of RFC 6455, section 1.3: it guards against caches, which keep no WebSocket anyway.
constexpr const char* kKey = "dGhlIHNhbXBsZSBub25jZQ==";
constexpr const char* kAnswerToKey = "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=";

/// Byte by byte, since what follows belongs to the WebSocket. Answers are a few hundred bytes.
std::string receiveHead(int socket) {
  std::string head;
  char c = 0;
  while (head.size() < kMostHeadBytes && (head.size() < 4 || head.compare(head.size() - 4, 4, "\r\n\r\n") != 0)) {
    if (::recv(socket, &c, 1, 0) != 1) return {};
    head += c;
  }
  return head;
}

int statusOf(const std::string& head) { return head.rfind("HTTP/1.1 ", 0) == 0 ? std::atoi(head.c_str() + 9) : 0; }

/// In the server's own words, where it has any.
tl::unexpected<Error> refusal(const Address& server, int status, const std::string& body) {
  if (status == 0) return fail(ErrorCode::Io, "what is at " + server.text() + " does not answer as a server should");
  const json problem = json::parse(body, nullptr, false);
  std::string detail = problem.is_object() && problem.contains("detail") && problem["detail"].is_string()
                           ? problem["detail"].get<std::string>()
                           : "the server answered " + std::to_string(status);
  return fail(status == 404 ? ErrorCode::NotFound : ErrorCode::Limit, std::move(detail));
}

Result<json> ask(const Address& server, const std::string& request_line, const std::string& body,
                 std::chrono::milliseconds patience) {
  auto socket = connectTo(server, patience);
  if (!socket) return tl::unexpected(socket.error());
  std::string request = request_line + " HTTP/1.1\r\nHost: " + server.text() + "\r\nConnection: close\r\n";
  if (!body.empty()) {
    request += "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) + "\r\n";
  }
  std::string head;
  if (sendAll(socket->handle(), request + "\r\n" + body)) head = receiveHead(socket->handle());
  std::string answer;
  std::array<char, 16384> some{};
  for (ssize_t count = 0; !head.empty() && answer.size() < kMostBodyBytes &&
                          (count = ::recv(socket->handle(), some.data(), some.size(), 0)) > 0;) {
    answer.append(some.data(), static_cast<std::size_t>(count));
  }
  const int status = statusOf(head);
  json parsed = json::parse(answer, nullptr, false);
  if (status < 200 || status > 299) return refusal(server, status, answer);
  if (!parsed.is_object()) return refusal(server, 0, "");
  return parsed;
}

/// An id goes into an address and must not end it.
bool isId(const std::string& id) {
  return !id.empty() && id.size() < 100 &&
         std::all_of(
             id.begin(), id.end(),
             [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); });
}

Result<Site> siteFrom(const Address& server, const json& row, const std::string& case_id, const std::string& path_id) {
  try {
    for (const json& path : row.at("paths")) {
      if (path.at("id") != path_id) continue;
      return Site{case_id, path_id, path.at("length_mm").get<double>(), path.at("lead_mm").get<double>(),
                  path.at("bit").at("diameter_mm").get<double>()};
    }
  } catch (const json::exception&) {
    return refusal(server, 0, "");
  }
  return fail(ErrorCode::NotFound, "there is no path " + path_id + " in case " + case_id);
}

}  // namespace

Result<Site> findSite(const Address& server, const std::string& case_id, const std::string& path_id,
                      std::chrono::milliseconds patience) {
  if (!isId(case_id)) return fail(ErrorCode::NotFound, "there is no case " + case_id);
  const auto row = ask(server, "GET /api/v1/cases/" + case_id, "", patience);
  if (!row) return tl::unexpected(row.error());
  return siteFrom(server, *row, case_id, path_id);
}

Result<std::string> makeSession(const Address& server, const std::string& case_id, const std::string& path_id,
                                std::chrono::milliseconds patience) {
  const auto made = ask(server, "POST /api/v1/sessions",
                        json{{"case_id", case_id}, {"path_id", path_id}}.dump(-1, ' ', true), patience);
  if (!made) return tl::unexpected(made.error());
  const auto id = made->find("id");
  if (id == made->end() || !id->is_string() || !isId(id->get<std::string>())) return refusal(server, 0, "");
  return id->get<std::string>();
}

Result<Socket> openWebSocket(const Address& server, const std::string& session, std::chrono::milliseconds patience) {
  auto socket = connectTo(server, patience);
  if (!socket) return socket;
  const std::string request = "GET /ws/drill/" + session + " HTTP/1.1\r\nHost: " + server.text() +
                              "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                              "Sec-WebSocket-Key: " +
                              kKey + "\r\n\r\n";
  std::string head;
  if (sendAll(socket->handle(), request)) head = receiveHead(socket->handle());
  const int status = statusOf(head);
  if (status == 101 && head.find(kAnswerToKey) != std::string::npos) return socket;
  if (status == 404) return fail(ErrorCode::NotFound, "the server knows this session no more");
  return refusal(server, status == 101 ? 0 : status, "");
}

}  // namespace spinaltap::haptic_client
