// The only file that includes Beast: sockets, bounds of size and time, and nothing of what is asked.
#include "server/http/server.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio.hpp>
#include <boost/beast.hpp>
#include <thread>
#include <tuple>

#include "server/http/api.h"
#include "server/http/static_files.h"
#include "server/ws/drill_hub.h"
#include "server/ws/realtime.h"

namespace spinaltap::http {
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace bhttp = boost::beast::http;
namespace websocket = boost::beast::websocket;
using asio::awaitable;
using asio::ip::tcp;
using boost::system::error_code;
using Socket = websocket::stream<beast::tcp_stream>;
using BeastRequest = bhttp::request<bhttp::string_body>;

namespace {

constexpr auto kRequestTime = std::chrono::seconds(30);  // also how long a connection may idle
constexpr auto kSendTime = std::chrono::seconds(60);     // a chunk of a body
constexpr auto kPlanTime = std::chrono::seconds(120);
constexpr auto kEndTime = std::chrono::seconds(5);
constexpr std::size_t kLargestBody = 1 << 20;
constexpr std::uint32_t kLargestHeader = 16 << 10;
constexpr int kMostConnections = 512, kMostPlans = 8, kSocketThreads = 2, kApiThreads = 4;
constexpr std::string_view kDrill = "/ws/drill/";

/// Ignores the error code, which the caller looks at.
auto noThrow(error_code& error) { return asio::redirect_error(asio::use_awaitable, error); }

class Server {
 public:
  Server(store::Store& store, const Options& options)
      : store_(store), options_(options), api_(store, waiting_), files_(options.web) {}

  Result<void> run(const std::function<void(const Listening&)>& listening);

 private:
  Result<void> listen();
  awaitable<void> acceptLoop();
  awaitable<void> connection(beast::tcp_stream stream);
  awaitable<void> connectionLoop(beast::tcp_stream& stream);
  awaitable<Response> respond(Request request);
  awaitable<bool> write(beast::tcp_stream& stream, const BeastRequest& request, Response response);
  awaitable<bool> writeBody(beast::tcp_stream& stream, const Response& response);

  std::optional<Response> admit(const std::string& id);
  awaitable<void> drill(beast::tcp_stream& stream, const BeastRequest& request, const std::string& id,
                        const beast::flat_buffer& already_read);

  [[nodiscard]] bool knowsHost(std::string_view host) const;
  awaitable<void> waitForSignal();

  store::Store& store_;
  const Options& options_;
  ws::WaitingRoom waiting_;
  Api api_;
  StaticFiles files_;
  std::unique_ptr<ws::DrillHub> hub_;  ///< there while run() runs
  asio::io_context io_{kSocketThreads};
  asio::thread_pool api_threads_{kApiThreads}, plan_thread_{1};
  tcp::acceptor acceptor_{asio::make_strand(io_)};
  asio::signal_set signals_{acceptor_.get_executor(), SIGINT, SIGTERM};
  std::atomic<int> connections_ = 0, answering_ = 0, plans_ = 0;
  std::atomic<bool> ending_ = false;
};

Request plainRequest(const BeastRequest& from) {
  Request request;
  request.method = std::string(from.method_string());
  request.path = decodePath({from.target().data(), from.target().size()});
  for (const auto& field : from) {
    std::string name(field.name_string());
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c); });
    std::string& value = request.headers[name];
    if (!value.empty()) value += ", ";
    value.append(field.value().data(), field.value().size());
  }
  request.body = from.body();
  return request;
}

/// Browsers send Origin with every socket and every change; a page from elsewhere is told no. Programs send none.
bool isForeign(const Request& request) {
  const std::string_view origin = request.header("origin");
  if (origin.empty()) return false;
  const std::size_t scheme = origin.find("://");
  return scheme == std::string_view::npos || origin.substr(scheme + 3) != request.header("host");
}

void addSafetyHeaders(bhttp::response_header<>& header) {
  header.set("X-Content-Type-Options", "nosniff");
  header.set("Referrer-Policy", "no-referrer");
  header.set("Cross-Origin-Opener-Policy", "same-origin");
  header.set("Cross-Origin-Embedder-Policy", "require-corp");
  header.set("Cross-Origin-Resource-Policy", "same-origin");
  // WebAssembly has to be compiled; nothing else may be made out of text
  header.set("Content-Security-Policy",
             "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
             "img-src 'self' data: blob:; font-src 'self'; connect-src 'self'; worker-src 'self' blob:; "
             "manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
}

std::string_view hostOnly(std::string_view host) {
  if (!host.empty() && host.front() == '[') return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

Response answerToBrokenRequest(const error_code& error) {
  if (error == bhttp::error::body_limit) return problem(413, "the body is over 1 MiB");
  if (error == bhttp::error::header_limit) return problem(431, "the header is over 16 KiB");
  return problem(400, "this is not HTTP");
}

bool isParserError(const error_code& error) {
  return error.category() == bhttp::make_error_code(bhttp::error::bad_method).category() &&
         error != bhttp::error::end_of_stream && error != bhttp::error::partial_message;
}

}  // namespace

Result<void> Server::listen() {
  error_code error;
  const auto address = asio::ip::make_address(options_.address, error);
  if (error) return fail(ErrorCode::InvalidArgument, "--address: '" + options_.address + "' is not an IP address");
  const tcp::endpoint endpoint(address, options_.port);
  try {
    acceptor_.open(endpoint.protocol());
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    acceptor_.bind(endpoint);
    acceptor_.listen(asio::socket_base::max_listen_connections);
  } catch (const boost::system::system_error& refused) {
    return fail(ErrorCode::Io, "cannot listen on " + options_.address + " port " + std::to_string(options_.port) +
                                   ": " + refused.code().message());
  }
  return {};
}

awaitable<void> Server::acceptLoop() {
  while (!ending_) {
    error_code error;
    tcp::socket socket(asio::make_strand(io_));
    co_await acceptor_.async_accept(socket, noThrow(error));
    if (error == asio::error::operation_aborted) co_return;
    if (error) {  // out of file handles: let some connections end
      asio::steady_timer pause(co_await asio::this_coro::executor, std::chrono::milliseconds(50));
      co_await pause.async_wait(noThrow(error));
      continue;
    }
    if (connections_ >= kMostConnections) continue;  // closes it
    std::ignore = socket.set_option(tcp::no_delay(true), error);
    const auto strand = socket.get_executor();
    asio::co_spawn(strand, connection(beast::tcp_stream(std::move(socket))), asio::detached);
  }
}

awaitable<void> Server::connection(beast::tcp_stream stream) {
  ++connections_;
  try {
    co_await connectionLoop(stream);
  } catch (const std::exception&) {
    stream.close();  // out of memory in one connection ends that one
  }
  error_code ignored;
  if (stream.socket().is_open()) std::ignore = stream.socket().shutdown(tcp::socket::shutdown_send, ignored);
  --connections_;
}

awaitable<void> Server::connectionLoop(beast::tcp_stream& stream) {
  beast::flat_buffer buffer;
  for (;;) {
    bhttp::request_parser<bhttp::string_body> parser;
    parser.body_limit(kLargestBody);
    parser.header_limit(kLargestHeader);
    stream.expires_after(kRequestTime);
    error_code error;
    co_await bhttp::async_read(stream, buffer, parser, noThrow(error));
    if (isParserError(error)) {
      BeastRequest broken(bhttp::verb::get, "/", 11);
      broken.keep_alive(false);
      co_await write(stream, broken, answerToBrokenRequest(error));
    }
    if (error) co_return;
    const BeastRequest request = parser.release();
    Request plain = plainRequest(request);
    if (websocket::is_upgrade(request) && plain.path.rfind(kDrill, 0) == 0 && knowsHost(plain.header("host")) &&
        !isForeign(plain)) {
      const std::string id = plain.path.substr(kDrill.size());
      std::optional<Response> refused = admit(id);
      if (!refused) {
        co_await drill(stream, request, id, buffer);
      } else {
        co_await write(stream, request, std::move(*refused));
      }
      co_return;
    }
    stream.expires_after(kPlanTime);
    ++answering_;
    Response response = co_await respond(std::move(plain));
    const bool more = co_await write(stream, request, std::move(response));
    --answering_;
    if (!more || ending_) co_return;
  }
}

bool Server::knowsHost(std::string_view host) const {
  error_code ignored;
  if (!asio::ip::make_address(options_.address, ignored).is_loopback()) return true;
  const std::string_view name = hostOnly(host);
  for (const char* known : {"localhost", "127.0.0.1", "[::1]"}) {
    if (name == known) return true;
  }
  return name == options_.address ||
         std::find(options_.hosts.begin(), options_.hosts.end(), name) != options_.hosts.end();
}

awaitable<Response> Server::respond(Request request) {
  if (request.path.empty()) co_return problem(400, "the address is malformed");
  if (!knowsHost(request.header("host"))) co_return problem(421, "this server goes by another name (see serve --host)");
  const bool reads = request.method == "GET" || request.method == "HEAD";
  if (!reads && isForeign(request)) co_return problem(403, "changes are taken from this server's own pages only");
  if (request.path.rfind(kDrill, 0) == 0) {
    const bool upgrade = !request.header("upgrade").empty();
    if (upgrade && isForeign(request)) co_return problem(403, "drills are taken from this server's own pages only");
    co_return upgrade ? problem(404, "there is no such drill session, or it was used or waited too long")
                      : problem(426, "a drill session is a WebSocket");
  }
  const bool heavy = Api::isHeavy(request) && Api::owns(request.path);
  if (heavy && plans_ >= kMostPlans) {
    Response busy = problem(503, "too many paths are being planned");
    busy.headers.emplace_back("Retry-After", "10");
    co_return busy;
  }
  const auto here = co_await asio::this_coro::executor;
  plans_ += heavy ? 1 : 0;
  asio::thread_pool& pool = heavy ? plan_thread_ : api_threads_;
  co_await asio::post(pool.get_executor(), asio::use_awaitable);
  thread_local const bool yields = (ws::yieldToLiveLoops(), true);
  std::ignore = yields;
  Response response;
  try {
    if (request.path == "/metrics" && reads) {
      response.text = hub_->metricsText();
      response.headers = {{"Content-Type", "text/plain; version=0.0.4; charset=utf-8"}, {"Cache-Control", "no-store"}};
    } else if (Api::owns(request.path)) {
      response = api_.handle(request);
    } else if (reads) {
      response = files_.handle(request);
    } else {
      response = problem(405, "the method here is GET, HEAD");
      response.headers.emplace_back("Allow", "GET, HEAD");
    }
  } catch (const std::exception&) {
    response = problem(500, "the server ran out of something");
  }
  plans_ -= heavy ? 1 : 0;
  co_await asio::post(here, asio::use_awaitable);
  co_return response;
}

awaitable<bool> Server::write(beast::tcp_stream& stream, const BeastRequest& request, Response response) {
  const bool head_only = request.method() == bhttp::verb::head || response.status == 304;
  const bool keep = request.keep_alive() && !ending_;
  bhttp::response<bhttp::empty_body> header;
  header.version(request.version());
  header.result(static_cast<unsigned>(response.status));
  header.reason(reasonOf(response.status));
  for (const auto& [name, value] : response.headers) header.set(name, value);
  addSafetyHeaders(header);
  if (response.status != 304) header.content_length(response.contentLength());
  header.keep_alive(keep);
  error_code error;
  bhttp::response_serializer<bhttp::empty_body> serializer(header);
  stream.expires_after(kSendTime);
  co_await bhttp::async_write_header(stream, serializer, noThrow(error));
  if (error) co_return false;
  if (!head_only && !co_await writeBody(stream, response)) co_return false;
  co_return keep;
}

awaitable<bool> Server::writeBody(beast::tcp_stream& stream, const Response& response) {
  error_code error;
  if (response.memory || response.file.empty()) {
    const auto body = response.memory
                          ? asio::buffer(response.memory->data() + response.offset, response.length)
                          : asio::buffer(static_cast<const void*>(response.text.data()), response.text.size());
    co_await asio::async_write(stream, body, noThrow(error));
    co_return !error;
  }
  const std::unique_ptr<int, void (*)(int*)> file(new int(::open(response.file.c_str(), O_RDONLY | O_CLOEXEC)),
                                                  [](int* handle) {
                                                    if (*handle >= 0) ::close(*handle);
                                                    delete handle;
                                                  });
  std::vector<std::byte> chunk(256 << 10);
  for (std::uint64_t sent = 0; sent < response.length;) {
    const std::size_t want = std::min<std::uint64_t>(chunk.size(), response.length - sent);
    const ssize_t got = ::pread(*file, chunk.data(), want, static_cast<off_t>(response.offset + sent));
    if (got <= 0) co_return false;  // the length is promised already: all that is left is to break off
    stream.expires_after(kSendTime);
    co_await asio::async_write(stream, asio::buffer(chunk.data(), static_cast<std::size_t>(got)), noThrow(error));
    if (error) co_return false;
    sent += static_cast<std::uint64_t>(got);
  }
  co_return true;
}

/// What is wrong with taking a WebSocket for this session; nothing when it may come.
std::optional<Response> Server::admit(const std::string& id) {
  if (const auto ticket = waiting_.take(id)) {
    const auto begun = hub_->begin(id, *ticket);
    return begun ? std::nullopt : std::optional(problem(503, begun.error().message));
  }
  if (hub_->knows(id)) return {};
  return problem(404, "there is no such drill session, or it was used or waited too long");
}

/// The handshake is Beast's; what follows is the live loops' alone.
awaitable<void> Server::drill(beast::tcp_stream& stream, const BeastRequest& request, const std::string& id,
                              const beast::flat_buffer& already_read) {
  stream.expires_after(kRequestTime);
  Socket socket(std::move(stream));
  error_code error;
  co_await socket.async_accept(request, noThrow(error));
  if (error) co_return;
  const int handle = beast::get_lowest_layer(socket).release_socket().release(error);
  if (error) co_return;
  const auto* data = static_cast<const std::byte*>(already_read.data().data());
  hub_->adopt(handle, id, {data, data + already_read.size()});
}

/// Stops taking connections, and gives what is being answered five seconds.
awaitable<void> Server::waitForSignal() {
  co_await signals_.async_wait(asio::use_awaitable);
  ending_ = true;
  error_code ignored;
  std::ignore = acceptor_.close(ignored);
  const auto until = std::chrono::steady_clock::now() + kEndTime;
  asio::steady_timer pause(acceptor_.get_executor());
  while (answering_ > 0 && std::chrono::steady_clock::now() < until) {
    pause.expires_after(std::chrono::milliseconds(10));
    co_await pause.async_wait(noThrow(ignored));
  }
  io_.stop();
}

Result<void> Server::run(const std::function<void(const Listening&)>& listening) {
  if (const auto open = listen(); !open) return open;
  auto hub = ws::DrillHub::start(store_, options_.drills);
  if (!hub) return tl::unexpected(hub.error());
  hub_ = std::move(*hub);
  asio::co_spawn(acceptor_.get_executor(), waitForSignal(), asio::detached);
  asio::co_spawn(acceptor_.get_executor(), acceptLoop(), asio::detached);
  const std::uint16_t port = acceptor_.local_endpoint().port();
  const bool v6 = acceptor_.local_endpoint().address().is_v6();
  const std::string host = v6 ? "[" + options_.address + "]" : options_.address;
  std::thread second([this] { io_.run(); });
  listening({"http://" + host + ":" + std::to_string(port) + "/", port, hub_->realtimeLine()});
  io_.run();
  second.join();
  hub_->stop();  // every recording is kept before the program ends
  plan_thread_.join();
  api_threads_.join();
  return {};
}

Result<void> serve(store::Store& store, const Options& options,
                   const std::function<void(const Listening&)>& listening) {
  Server server(store, options);
  return server.run(listening);
}

}  // namespace spinaltap::http
