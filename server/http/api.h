// server/http/api.h - REST: what is asked under /api/v1 (contract: server/contract/openapi.json), /healthz and /readyz.
#pragma once
#include <string>
#include <vector>

#include "server/http/message.h"
#include "server/mesh_out/mesh_file.h"
#include "server/store/store.h"
#include "server/ws/waiting_room.h"

namespace spinaltap::http {

/// Safe from several threads. Answers block while they read files or plan; call it from threads that may.
class Api {
 public:
  Api(store::Store& store, ws::WaitingRoom& waiting) : store_(store), waiting_(waiting) {}

  /// Whether the path is the API's, not a page.
  [[nodiscard]] static bool owns(const std::string& path);
  /// Whether the answer takes seconds of work.
  [[nodiscard]] static bool isHeavy(const Request& request);
  [[nodiscard]] Response handle(const Request& request);

 private:
  using Parts = std::vector<std::string>;
  using Handler = Response (Api::*)(const Request&, const Parts&);
  struct Route {
    const char *method, *pattern;
    Handler handler;
  };
  static const std::vector<Route>& routes();

  Response listCases(const Request&, const Parts&);
  Response showCase(const Request&, const Parts& ids);
  Response sendMesh(const Request&, const Parts& ids);
  Response sendStl(const Request&, const Parts& ids);
  Response sendPly(const Request&, const Parts& ids);
  Response sendVolume(const Request&, const Parts& ids);
  Response sendPointVolume(const Request&, const Parts& ids);
  Response addPath(const Request&, const Parts& ids);
  Response showPath(const Request&, const Parts& ids);
  Response replacePath(const Request&, const Parts& ids);
  Response removePath(const Request&, const Parts& ids);
  Response addSession(const Request&, const Parts&);
  Response listRecordings(const Request&, const Parts& ids);
  Response sendRecording(const Request&, const Parts& ids);
  Response health(const Request&, const Parts&);
  Response ready(const Request&, const Parts&);
  tl::expected<store::Path, Response> plan(const Request& request, const std::string& case_id,
                                           const std::string& path_id);
  Response sendMeshFile(const Request& request, const std::string& case_id, mesh_out::Format format);
  Response sendBlob(const Request& request, const store::BlobId& id, const std::string& missing);

  store::Store& store_;
  ws::WaitingRoom& waiting_;
};

}  // namespace spinaltap::http
