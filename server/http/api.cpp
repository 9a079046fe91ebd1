#include "server/http/api.h"

#include <nlohmann/json.hpp>
#include <optional>

#include "core/session/session.h"
#include "server/http/entity.h"
#include "server/jobs/export_job.h"
#include "server/jobs/plan_job.h"
#include "server/store/rows.h"

namespace spinaltap::http {
namespace {
using json = nlohmann::ordered_json;

Response jsonResponse(const json& body, int status = 200) {
  Response response;
  response.status = status;
  response.text = body.dump(-1, ' ', false, json::error_handler_t::replace);
  response.headers = {{"Content-Type", "application/json"}, {"Cache-Control", "no-store"}};
  return response;
}

Response problemOf(const Error& error) {
  switch (error.code) {
    case ErrorCode::NotFound:
      return problem(404, error.message);
    case ErrorCode::Io:
    case ErrorCode::Corrupt:
      return problem(500, error.message);
    default:
      return problem(422, error.message);
  }
}

/// "/api/v1/cases/{}/mesh" against a path: the parts where {} stands, or nothing.
std::optional<std::vector<std::string>> match(std::string_view pattern, std::string_view path) {
  std::vector<std::string> parts;
  while (!pattern.empty() && !path.empty()) {
    const std::string_view want = pattern.substr(0, pattern.find('/', 1)), have = path.substr(0, path.find('/', 1));
    if (want == "/{}") {
      if (have.size() < 2) return {};
      parts.emplace_back(have.substr(1));
    } else if (want != have) {
      return {};
    }
    pattern.remove_prefix(want.size());
    path.remove_prefix(have.size());
  }
  if (!pattern.empty() || !path.empty()) return {};
  return parts;
}

json describe(const store::Recording& row) {
  return {{"id", row.id},
          {"case_id", row.case_id},
          {"path_id", row.path_id},
          {"created", row.created},
          {"cycles", row.cycles},
          {"complete", row.complete},
          {"metrics", json::parse(row.metrics_json, nullptr, false)}};
}

json summary(const store::Case& row) {
  return {{"id", row.id},           {"label", row.label},
          {"created", row.created}, {"stage", store::nameOf(row.stage)},
          {"paths", row.paths},     {"recordings", row.recordings}};
}

json recordingsOf(const std::vector<store::Recording>& rows) {
  json list = json::array();
  for (const auto& row : rows) list.push_back(describe(row));
  return list;
}

/// The body as a JSON object, or the problem with it.
tl::expected<json, Response> parseBody(const Request& request) {
  const std::string_view type = request.header("content-type");
  // A form of another page cannot send this type without asking first, so it guards against forged requests too.
  if (type.substr(0, type.find(';')) != "application/json") {
    return tl::unexpected(problem(415, "the body's type is application/json"));
  }
  json body = json::parse(request.body, nullptr, false);
  if (!body.is_object()) return tl::unexpected(problem(400, "the body is not a JSON object"));
  return body;
}

/// Everything but entry and target has a default. Throws json::exception on wrong types.
jobs::PlanJob planJobOf(const json& body) {
  jobs::PlanJob job;
  job.label = body.value("label", "");
  job.path.entry_patient = store::vec3From(body.at("entry_patient"));
  job.path.target_patient = store::vec3From(body.at("target_patient"));
  if (body.contains("bit")) {
    const json& bit = body.at("bit");
    job.path.bit.diameter_mm = bit.value("diameter_mm", job.path.bit.diameter_mm);
    job.path.bit.cone_length_mm = bit.value("cone_length_mm", job.path.bit.cone_length_mm);
    job.path.bit.length_mm = bit.value("length_mm", job.path.bit.length_mm);
  }
  job.path.volume_radius_mm = body.value("volume_radius_mm", job.path.volume_radius_mm);
  job.path.lead_mm = body.value("lead_mm", jobs::kLead_mm);
  job.path.spacing_mm = body.value("spacing_mm", job.path.spacing_mm);
  return job;
}

}  // namespace

const std::vector<Api::Route>& Api::routes() {
  static const std::vector<Route> kRoutes{
      {"GET", "/api/v1/cases", &Api::listCases},
      {"GET", "/api/v1/cases/{}", &Api::showCase},
      {"GET", "/api/v1/cases/{}/mesh", &Api::sendMesh},
      {"GET", "/api/v1/cases/{}/mesh.stl", &Api::sendStl},
      {"GET", "/api/v1/cases/{}/mesh.ply", &Api::sendPly},
      {"GET", "/api/v1/cases/{}/volume", &Api::sendVolume},
      {"POST", "/api/v1/cases/{}/paths", &Api::addPath},
      {"GET", "/api/v1/cases/{}/paths/{}", &Api::showPath},
      {"PUT", "/api/v1/cases/{}/paths/{}", &Api::replacePath},
      {"DELETE", "/api/v1/cases/{}/paths/{}", &Api::removePath},
      {"GET", "/api/v1/cases/{}/paths/{}/point-volume", &Api::sendPointVolume},
      {"GET", "/api/v1/cases/{}/recordings", &Api::listRecordings},
      {"POST", "/api/v1/sessions", &Api::addSession},
      {"GET", "/api/v1/recordings/{}", &Api::sendRecording},
      {"GET", "/healthz", &Api::health},
      {"GET", "/readyz", &Api::ready},
  };
  return kRoutes;
}

bool Api::owns(const std::string& path) {
  return path.rfind("/api/", 0) == 0 || path == "/api" || path == "/healthz" || path == "/readyz";
}

bool Api::isHeavy(const Request& request) {
  return request.method == "PUT" || (request.method == "POST" && request.path != "/api/v1/sessions");
}

Response Api::handle(const Request& request) {
  const std::string method = request.method == "HEAD" ? "GET" : request.method;
  std::string allowed;
  for (const Route& route : routes()) {
    const auto parts = match(route.pattern, request.path);
    if (!parts) continue;
    if (method == route.method) return (this->*route.handler)(request, *parts);
    allowed += (allowed.empty() ? "" : ", ") + std::string(route.method);
    if (allowed == "GET") allowed = "GET, HEAD";
  }
  if (allowed.empty()) return problem(404, "there is nothing at this address");
  Response response = problem(405, "the method here is " + allowed);
  response.headers.emplace_back("Allow", allowed);
  return response;
}

Response Api::listCases(const Request&, const Parts&) {
  const auto cases = store_.cases();
  if (!cases) return problemOf(cases.error());
  json list = json::array();
  for (const store::Case& row : *cases) list.push_back(summary(row));
  return jsonResponse({{"cases", list}});
}

Response Api::showCase(const Request&, const Parts& ids) {
  const auto row = store_.findCase(ids[0]);
  if (!row) return problemOf(row.error());
  const auto paths = store_.paths(ids[0]);
  if (!paths) return problemOf(paths.error());
  const auto recordings = store_.recordings(ids[0]);
  if (!recordings) return problemOf(recordings.error());
  json body = summary(*row);
  body["grid"] = store::toJson(row->grid);
  body["figures"] = json::parse(row->figures_json, nullptr, false);
  body["paths"] = json::array();
  for (const store::Path& path : *paths) body["paths"].push_back(jobs::describe(path));
  body["recordings"] = recordingsOf(*recordings);
  return jsonResponse(body);
}

Response Api::sendBlob(const Request& request, const store::BlobId& id, const std::string& missing) {
  if (id.empty()) return problem(404, missing);
  const auto file = store_.blobs().file(id);
  if (!file) return problem(500, file.error().message);
  Entity entity;
  entity.file = *file;
  entity.packed_file = store_.blobs().gzipFile(id);
  entity.tag = id;
  entity.type = "application/octet-stream";
  return answer(request, entity);
}

Response Api::sendMesh(const Request& request, const Parts& ids) {
  const auto row = store_.findCase(ids[0]);
  return row ? sendBlob(request, row->mesh, "case " + row->id + " is not reconstructed yet") : problemOf(row.error());
}

/// Made anew each time, some 50 ms: it is asked for once in a while, and would double what a case takes on disk.
Response Api::sendMeshFile(const Request& request, const std::string& case_id, mesh_out::Format format) {
  const auto row = store_.findCase(case_id);
  if (!row) return problemOf(row.error());
  auto bytes = jobs::meshFile(store_, *row, format);
  if (!bytes) return problemOf(bytes.error());
  Entity entity;
  entity.tag = store::blobIdOf(*bytes);
  entity.plain = std::make_shared<const std::vector<std::byte>>(std::move(*bytes));
  entity.type = mesh_out::mediaTypeOf(format);
  Response response = answer(request, entity);
  response.headers.emplace_back("Content-Disposition",
                                "attachment; filename=\"spinaltap-" + row->id + "." + mesh_out::nameOf(format) + "\"");
  return response;
}

Response Api::sendStl(const Request& request, const Parts& ids) {
  return sendMeshFile(request, ids[0], mesh_out::Format::Stl);
}

Response Api::sendPly(const Request& request, const Parts& ids) {
  return sendMeshFile(request, ids[0], mesh_out::Format::Ply);
}

Response Api::sendVolume(const Request& request, const Parts& ids) {
  const auto row = store_.findCase(ids[0]);
  return row ? sendBlob(request, row->roi, "case " + row->id + " is not reconstructed yet") : problemOf(row.error());
}

Response Api::sendPointVolume(const Request& request, const Parts& ids) {
  const auto row = store_.findPath(ids[0], ids[1]);
  return row ? sendBlob(request, row->point_volume, "path " + row->id + " has no points") : problemOf(row.error());
}

Response Api::sendRecording(const Request& request, const Parts& ids) {
  const auto row = store_.findRecording(ids[0]);
  return row ? sendBlob(request, row->bytes, "recording " + row->id + " is empty") : problemOf(row.error());
}

Response Api::listRecordings(const Request&, const Parts& ids) {
  const auto row = store_.findCase(ids[0]);
  if (!row) return problemOf(row.error());
  const auto recordings = store_.recordings(ids[0]);
  if (!recordings) return problemOf(recordings.error());
  return jsonResponse({{"recordings", recordingsOf(*recordings)}});
}

tl::expected<store::Path, Response> Api::plan(const Request& request, const std::string& case_id,
                                              const std::string& path_id) {
  const auto body = parseBody(request);
  if (!body) return tl::unexpected(body.error());
  jobs::PlanJob job;
  try {
    job = planJobOf(*body);
  } catch (const json::exception&) {
    return tl::unexpected(
        problem(422, "the body needs entry_patient and target_patient, [x, y, z] in mm, and numbers elsewhere"));
  }
  job.case_id = case_id, job.path_id = path_id;
  auto made = jobs::planPath(store_, job, {});
  if (!made) return tl::unexpected(problemOf(made.error()));
  return std::move(*made);
}

Response Api::addPath(const Request& request, const Parts& ids) {
  const auto made = plan(request, ids[0], "");
  if (!made) return made.error();
  Response response = jsonResponse(jobs::describe(*made), 201);
  response.headers.emplace_back("Location", "/api/v1/cases/" + made->case_id + "/paths/" + made->id);
  return response;
}

Response Api::showPath(const Request&, const Parts& ids) {
  const auto row = store_.findPath(ids[0], ids[1]);
  return row ? jsonResponse(jobs::describe(*row)) : problemOf(row.error());
}

Response Api::replacePath(const Request& request, const Parts& ids) {
  const auto made = plan(request, ids[0], ids[1]);
  return made ? jsonResponse(jobs::describe(*made)) : made.error();
}

Response Api::removePath(const Request&, const Parts& ids) {
  const auto row = store_.removePath(ids[0], ids[1]);
  return row ? jsonResponse({{"id", row->id}, {"kept", row->drilled}}) : problemOf(row.error());
}

Response Api::addSession(const Request& request, const Parts&) {
  const auto body = parseBody(request);
  if (!body) return body.error();
  ws::Ticket ticket;
  try {
    ticket = {body->at("case_id").get<std::string>(), body->at("path_id").get<std::string>()};
  } catch (const json::exception&) {
    return problem(422, "the body needs case_id and path_id, both text");
  }
  const auto path = store_.findPathToDrill(ticket.case_id, ticket.path_id);
  if (!path) return problemOf(path.error());
  const auto id = waiting_.add(ticket);
  if (!id) return problem(503, id.error().message);
  const session::Config config{path->path.bit, session::Config{}.engine};
  const json answer{{"id", *id},
                    {"engine", config.engine},
                    {"config",
                     {{"bit", store::toJson(config.bit)},
                      {"engine", config.engine},
                      {"case_id", ticket.case_id},
                      {"path_id", ticket.path_id}}}};
  return jsonResponse(answer, 201);
}

Response Api::health(const Request&, const Parts&) { return jsonResponse({{"status", "ok"}}); }

Response Api::ready(const Request&, const Parts&) {
  const auto cases = store_.cases();
  return cases ? jsonResponse({{"status", "ready"}}) : problem(503, cases.error().message);
}

}  // namespace spinaltap::http
