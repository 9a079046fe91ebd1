// server/http/server.h - listens until a signal ends it. The headers of Beast stay in server.cpp.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "server/store/store.h"
#include "server/ws/drill_hub.h"

namespace spinaltap::http {

struct Options {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;         ///< 0 takes a free one
  std::filesystem::path web;         ///< the built pages; empty when there are none
  std::vector<std::string> hosts{};  ///< further names by which browsers may call it while it listens on loopback
  ws::HubOptions drills{};           ///< the live loops
};

struct Listening {
  std::string url;  ///< "http://127.0.0.1:8080/"
  std::uint16_t port = 0;
  std::string realtime;  ///< what was granted, one line; empty when it was not asked for
};

/// Returns after SIGINT or SIGTERM, when what is being answered is answered and every live drill is kept.
/// @error Io (the address cannot be listened on), InvalidArgument (no address).
[[nodiscard]] Result<void> serve(store::Store& store, const Options& options,
                                 const std::function<void(const Listening&)>& listening);

}  // namespace spinaltap::http
