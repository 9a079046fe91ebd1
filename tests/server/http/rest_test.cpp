// The real server over real sockets.
#include <gtest/gtest.h>

#include <fstream>

#include "core/wire/point_volume_message.h"
#include "tests/server/program.h"
#include "tests/server/small_case.h"
#include "tests/server/sockets.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::test {
namespace {
using nlohmann::json;

/// One server with one small case for all tests of a suite; nothing here changes the case but for adding paths.
class Rest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    {
      auto store = store::Store::open(folder_->path()).value();
      small_ = makeSmallCase(store);
      bare_ = store.addCase({}).value().id;
    }
    server_ = new Server(folder_->path().string());
  }
  static void TearDownTestSuite() {
    EXPECT_EQ(server_->end(), 0) << "SIGTERM ends the server in good order";
    delete server_;
    delete folder_;
  }
  static int port() { return server_->port(); }
  static std::string caseUrl(const std::string& rest = "") { return "/api/v1/cases/" + small_.case_id + rest; }

  static TemporaryFolder* folder_;
  static Server* server_;
  static SmallCase small_;
  static std::string bare_;
};
TemporaryFolder* Rest::folder_ = nullptr;
Server* Rest::server_ = nullptr;
SmallCase Rest::small_;
std::string Rest::bare_;

void expectProblem(const Reply& reply, int status) {
  EXPECT_EQ(reply.status, status) << reply.body;
  EXPECT_EQ(reply.header("content-type"), "application/problem+json");
  const json body = reply.json();
  EXPECT_EQ(body.value("status", 0), status);
  EXPECT_FALSE(body.value("detail", "").empty());
  EXPECT_FALSE(body.value("title", "").empty());
}

TEST_F(Rest, PrintsOneLineWithItsAddress) {
  EXPECT_EQ(server_->line(), "SpinalTap: http://127.0.0.1:" + std::to_string(port()) + "/");
}

TEST_F(Rest, ListsAndShowsCases) {
  const json list = get(port(), "/api/v1/cases").json();
  ASSERT_EQ(list["cases"].size(), 2u);
  const json shown = get(port(), caseUrl()).json();
  EXPECT_EQ(shown["stage"], "reconstructed");
  EXPECT_EQ(shown["grid"]["dims"], json({12, 12, 20}));
  EXPECT_EQ(shown["figures"]["centres"], 0);
  const json& path = shown["paths"][0];
  EXPECT_EQ(path["id"], small_.path_id);
  EXPECT_EQ(path["entry_patient"], json({0.0, 0.0, 0.0}));
  EXPECT_EQ(path["length_mm"], 6.0);
  EXPECT_EQ(path["lattice"]["first_disc"], -4);  // a lead of 1 mm at 0.25 mm
}

TEST_F(Rest, SendsBodiesWithTheirHashAsTag) {
  const Reply reply = get(port(), caseUrl("/paths/" + small_.path_id + "/point-volume"));
  ASSERT_EQ(reply.status, 200);
  EXPECT_EQ(reply.header("content-type"), "application/octet-stream");
  const auto* data = reinterpret_cast<const std::byte*>(reply.body.data());
  EXPECT_EQ(reply.header("etag"), "\"" + store::blobIdOf({data, reply.body.size()}) + "\"");
  const auto volume = wire::decodePointVolume({data, reply.body.size()}).value();
  EXPECT_EQ(point_volume::countAlive(volume), small_.path.points_alive);
  EXPECT_EQ(get(port(), caseUrl("/mesh")).body.substr(0, 4), "STM1");
  EXPECT_EQ(get(port(), caseUrl("/volume")).body.substr(0, 4), "STV1");
}

TEST_F(Rest, SendsTheSurfaceAsFilesToSave) {
  const Reply stl = get(port(), caseUrl("/mesh.stl")), ply = get(port(), caseUrl("/mesh.ply"));
  ASSERT_EQ(stl.status, 200);
  EXPECT_EQ(stl.header("content-type"), "model/stl");
  EXPECT_EQ(stl.header("content-disposition"), "attachment; filename=\"spinaltap-" + small_.case_id + ".stl\"");
  EXPECT_EQ(stl.body.size(), 84U + 50U) << "one triangle";
  EXPECT_EQ(ply.header("content-type"), "application/octet-stream");
  EXPECT_EQ(ply.body.rfind("ply\n", 0), 0U);
  for (const auto& [url, whole] : {std::pair(caseUrl("/mesh.stl"), stl), std::pair(caseUrl("/mesh.ply"), ply)}) {
    const auto* data = reinterpret_cast<const std::byte*>(whole.body.data());
    EXPECT_EQ(whole.header("etag"), "\"" + store::blobIdOf({data, whole.body.size()}) + "\"");
    EXPECT_EQ(get(port(), url, {"If-None-Match: " + whole.header("etag")}).status, 304);
    const Reply part = get(port(), url, {"Range: bytes=2-11"});
    EXPECT_EQ(part.status, 206);
    EXPECT_EQ(part.body, whole.body.substr(2, 10));
  }
  expectProblem(get(port(), "/api/v1/cases/" + bare_ + "/mesh.stl"), 404);
  expectProblem(get(port(), "/api/v1/cases/czzzzzzz/mesh.ply"), 404);
  expectProblem(get(port(), caseUrl("/mesh.obj")), 404);
}

TEST_F(Rest, AnswersAKnownTagWith304AndNoBody) {
  const std::string tag = get(port(), caseUrl("/mesh")).header("etag");
  for (const std::string& sent : {tag, "W/" + tag, "\"other\", " + tag, std::string("*")}) {
    const Reply reply = get(port(), caseUrl("/mesh"), {"If-None-Match: " + sent});
    EXPECT_EQ(reply.status, 304) << sent;
    EXPECT_EQ(reply.header("etag"), tag);
  }
  EXPECT_EQ(get(port(), caseUrl("/mesh"), {"If-None-Match: \"other\""}).status, 200);
}

TEST_F(Rest, SendsGzipWhenItIsAccepted) {
  const Reply plain = get(port(), caseUrl("/volume")),
              packed = get(port(), caseUrl("/volume"), {"Accept-Encoding: gzip"});
  EXPECT_EQ(packed.header("content-encoding"), "gzip");
  EXPECT_EQ(packed.header("vary"), "Accept-Encoding");
  EXPECT_LT(packed.body.size(), plain.body.size() / 2);
  EXPECT_NE(packed.header("etag"), plain.header("etag"));
  EXPECT_EQ(
      get(port(), caseUrl("/volume"), {"Accept-Encoding: gzip", "If-None-Match: " + packed.header("etag")}).status,
      304);
}

TEST_F(Rest, SendsRanges) {
  const std::string whole = get(port(), caseUrl("/volume")).body;
  const Reply part = get(port(), caseUrl("/volume"), {"Range: bytes=4-103", "Accept-Encoding: gzip"});
  EXPECT_EQ(part.status, 206);
  EXPECT_EQ(part.body, whole.substr(4, 100));
  EXPECT_EQ(part.header("content-range"), "bytes 4-103/" + std::to_string(whole.size()));
  const Reply past = get(port(), caseUrl("/volume"), {"Range: bytes=99999999-"});
  expectProblem(past, 416);
  EXPECT_EQ(past.header("content-range"), "bytes */" + std::to_string(whole.size()));
  EXPECT_EQ(get(port(), caseUrl("/volume"), {"Range: bytes=0-1", "If-Range: \"other\""}).status, 200);
}

TEST_F(Rest, HeadGivesTheLengthWithoutTheBody) {
  Connection connection(port());
  connection.send(requestText({"HEAD", caseUrl("/volume")}) + requestText({"GET", "/healthz"}));
  const Reply head = readReply(connection, false), next = readReply(connection);
  EXPECT_EQ(head.header("content-length"), std::to_string(get(port(), caseUrl("/volume")).body.size()));
  EXPECT_EQ(next.json()["status"], "ok") << "the next answer begins right after the header";
}

TEST_F(Rest, NamesWhatIsNotThere) {
  for (const std::string& url :
       {std::string("/api/v1/cases/czzzzzzz"), std::string("/api/v1/cases/czzzzzzz/mesh"),
        caseUrl("/paths/pzz/point-volume"), std::string("/api/v1/recordings/rzzzzzzz"),
        "/api/v1/cases/" + bare_ + "/mesh", std::string("/api/v1/nothing"), std::string("/api/v1/cases/"),
        std::string("/api/v2/cases"), std::string("/no-such-page.js")}) {
    expectProblem(get(port(), url), 404);
  }
}

TEST_F(Rest, SaysWhichMethodsThereAre) {
  const Reply reply = ask(port(), {"DELETE", caseUrl()});
  expectProblem(reply, 405);
  EXPECT_EQ(reply.header("allow"), "GET, HEAD");
  EXPECT_EQ(get(port(), "/api/v1/sessions").header("allow"), "POST");
  expectProblem(ask(port(), {"PUT", "/index.html"}), 405);
}

TEST_F(Rest, PlansAPath) {
  const json wanted{{"label", "slanted"},          {"entry_patient", {0, 0, 0}},
                    {"target_patient", {1, 0, 5}}, {"bit", {{"diameter_mm", 2.5}}},
                    {"volume_radius_mm", 2},       {"spacing_mm", 0.25}};
  const Reply reply = post(port(), caseUrl("/paths"), wanted);
  ASSERT_EQ(reply.status, 201) << reply.body;
  const json path = reply.json();
  EXPECT_EQ(path["bit"]["diameter_mm"], 2.5);
  EXPECT_EQ(path["bit"]["cone_length_mm"], 5.0);
  EXPECT_EQ(path["lead_mm"], 4.0);
  EXPECT_GT(path["points_alive"], 0);
  EXPECT_LT(path["points_alive"], path["points"]);
  EXPECT_EQ(get(port(), reply.header("location")).json(), path);
}

Reply put(int port, const std::string& url, const json& body) {
  return ask(port, {"PUT", url, body.dump(), {"Content-Type: application/json"}});
}

TEST_F(Rest, ReplacesAPathAndItsPointsUnderTheSameAddress) {
  json wanted{{"label", "first"}, {"entry_patient", {0, 0, 0}}, {"target_patient", {0, 0, 5}}, {"spacing_mm", 0.5}};
  const Reply made = post(port(), caseUrl("/paths"), wanted);
  ASSERT_EQ(made.status, 201) << made.body;
  const std::string url = made.header("location");
  const std::string points = get(port(), url + "/point-volume").body;
  wanted["target_patient"] = {1, 0, 7}, wanted["label"] = "second";
  const Reply replaced = put(port(), url, wanted);
  ASSERT_EQ(replaced.status, 200) << replaced.body;
  EXPECT_EQ(replaced.json()["id"], made.json()["id"]);
  EXPECT_EQ(get(port(), url).json(), replaced.json());
  EXPECT_EQ(get(port(), url).json()["label"], "second");
  EXPECT_NE(get(port(), url + "/point-volume").body, points);
  wanted["target_patient"] = {0, 0, 5};
  ASSERT_EQ(put(port(), url, wanted).status, 200);
  EXPECT_EQ(get(port(), url + "/point-volume").body, points) << "undone: the same points again";

  const Reply removed = ask(port(), {"DELETE", url});
  EXPECT_EQ(removed.json(), (json{{"id", made.json()["id"]}, {"kept", false}}));
  expectProblem(get(port(), url), 404);
  expectProblem(ask(port(), {"DELETE", url}), 404);
  expectProblem(put(port(), url, wanted), 404);
}

TEST_F(Rest, RefusesAReplacementThatCannotBePlannedAndKeepsThePath) {
  json wanted{{"entry_patient", {0, 0, 0}}, {"target_patient", {0, 0, 5}}, {"spacing_mm", 0.5}};
  const std::string url = post(port(), caseUrl("/paths"), wanted).header("location");
  const json before = get(port(), url).json();
  wanted["target_patient"] = {0, 0, 0};
  expectProblem(put(port(), url, wanted), 422);
  wanted["entry_patient"] = {0, 0, -90}, wanted["target_patient"] = {0, 0, -80};
  expectProblem(put(port(), url, wanted), 422);  // no bone there
  expectProblem(ask(port(), {"PUT", url, "{"}), 415);
  expectProblem(put(port(), "/api/v1/cases/" + bare_ + url.substr(url.find("/paths")), wanted), 404);
  EXPECT_EQ(get(port(), url).json(), before);
  ASSERT_EQ(ask(port(), {"DELETE", url}).status, 200);
}

TEST_F(Rest, APathThatASessionWasMadeForIsRetiredRatherThanChanged) {
  json wanted{{"entry_patient", {0, 0, 0}}, {"target_patient", {0, 0, 5}}, {"spacing_mm", 0.5}};
  const Reply made = post(port(), caseUrl("/paths"), wanted);
  const std::string url = made.header("location"), id = made.json()["id"];
  const std::string points = get(port(), url + "/point-volume").body;
  ASSERT_EQ(post(port(), "/api/v1/sessions", {{"case_id", small_.case_id}, {"path_id", id}}).status, 201);
  wanted["target_patient"] = {1, 0, 7};
  const Reply replaced = put(port(), url, wanted);
  ASSERT_EQ(replaced.status, 200) << replaced.body;
  EXPECT_NE(replaced.json()["id"], id);
  const json old = get(port(), url).json();
  EXPECT_EQ(old["retired"], true);
  EXPECT_EQ(old["replaced_by"], replaced.json()["id"]);
  EXPECT_EQ(old["target_patient"], json({0.0, 0.0, 5.0}));
  EXPECT_EQ(get(port(), url + "/point-volume").body, points) << "what the drill starts from is still there";
  const json shown = get(port(), caseUrl()).json();
  for (const json& path : shown["paths"]) EXPECT_NE(path["id"], id);
  const std::string next = caseUrl("/paths/" + replaced.json()["id"].get<std::string>());
  ASSERT_EQ(post(port(), "/api/v1/sessions", {{"case_id", small_.case_id}, {"path_id", replaced.json()["id"]}}).status,
            201);
  EXPECT_EQ(ask(port(), {"DELETE", next}).json()["kept"], true);
  EXPECT_EQ(get(port(), next + "/point-volume").status, 200);
}

TEST_F(Rest, RefusesWhatCannotBePlannedWithTheReason) {
  const json good{{"entry_patient", {0, 0, 0}}, {"target_patient", {0, 0, 5}}, {"spacing_mm", 0.25}};
  const auto with = [&good](const char* key, const json& value) {
    json body = good;
    body[key] = value;
    return body;
  };
  expectProblem(post(port(), caseUrl("/paths"), with("target_patient", {0, 0, 0})), 422);
  expectProblem(post(port(), caseUrl("/paths"), with("target_patient", {0, 0})), 422);
  expectProblem(post(port(), caseUrl("/paths"), with("target_patient", "0,0,1")), 422);
  expectProblem(post(port(), caseUrl("/paths"), with("spacing_mm", 0.01)), 422);  // over 32 million points
  expectProblem(post(port(), caseUrl("/paths"), with("spacing_mm", -1)), 422);
  expectProblem(post(port(), caseUrl("/paths"), with("label", std::string(101, 'x'))), 422);
  expectProblem(post(port(), caseUrl("/paths"), with("label", "two\nlines")), 422);
  expectProblem(post(port(), caseUrl("/paths"), with("bit", {{"diameter_mm", 1e300}})), 422);
  expectProblem(post(port(), "/api/v1/cases/czzzzzzz/paths", good), 404);
  expectProblem(post(port(), "/api/v1/cases/" + bare_ + "/paths", good), 404);
  const json nowhere{{"entry_patient", {0, 0, -90}}, {"target_patient", {0, 0, -80}}, {"spacing_mm", 0.25}};
  expectProblem(post(port(), caseUrl("/paths"), nowhere), 422);  // no bone there
}

TEST_F(Rest, TakesOnlyJsonObjects) {
  expectProblem(ask(port(), {"POST", caseUrl("/paths"), "{}", {"Content-Type: text/plain"}}), 415);
  expectProblem(ask(port(), {"POST", caseUrl("/paths"), "{}"}), 415);
  for (const char* body : {"{", "[]", "null", "\"x\"", "{\"a\":}", "\xff\xfe"}) {
    expectProblem(ask(port(), {"POST", caseUrl("/paths"), body, {"Content-Type: application/json"}}), 400);
  }
  const std::string deep = std::string(100'000, '[');
  expectProblem(ask(port(), {"POST", "/api/v1/sessions", deep, {"Content-Type: application/json"}}), 400);
}

TEST_F(Rest, TakesChangesOnlyFromItsOwnPages) {
  const json body{{"case_id", small_.case_id}, {"path_id", small_.path_id}};
  Ask foreign{
      "POST", "/api/v1/sessions", body.dump(), {"Content-Type: application/json", "Origin: https://evil.example"}};
  expectProblem(ask(port(), foreign), 403);
  foreign.headers[1] = "Origin: null";
  expectProblem(ask(port(), foreign), 403);
  Ask own = foreign;
  own.host = "127.0.0.1:" + std::to_string(port());
  own.headers[1] = "Origin: http://" + own.host;
  EXPECT_EQ(ask(port(), own).status, 201);
}

TEST_F(Rest, OnLoopbackAnswersOnlyToNamesOfThisMachine) {
  Ask rebound{"GET", "/api/v1/cases"};
  rebound.host = "evil.example";
  expectProblem(ask(port(), rebound), 421);
  for (const char* own : {"localhost", "localhost:8080", "127.0.0.1:1", "[::1]:99"}) {
    rebound.host = own;
    EXPECT_EQ(ask(port(), rebound).status, 200) << own;
  }
}

TEST_F(Rest, MakesSessionsOnlyForPathsThatExist) {
  const Reply reply = post(port(), "/api/v1/sessions", {{"case_id", small_.case_id}, {"path_id", small_.path_id}});
  ASSERT_EQ(reply.status, 201);
  EXPECT_EQ(reply.json()["engine"], "clearance");
  EXPECT_EQ(reply.json()["config"]["bit"]["diameter_mm"], 3.0);
  expectProblem(post(port(), "/api/v1/sessions", {{"case_id", small_.case_id}, {"path_id", "pzz"}}), 404);
  expectProblem(post(port(), "/api/v1/sessions", {{"case_id", bare_}, {"path_id", small_.path_id}}), 404);
  expectProblem(post(port(), "/api/v1/sessions", {{"case_id", small_.case_id}}), 422);
  expectProblem(post(port(), "/api/v1/sessions", {{"case_id", 7}, {"path_id", nullptr}}), 422);
}

TEST_F(Rest, SendsItsSafetyHeadersWithEverything) {
  for (const char* url : {"/api/v1/cases", "/nothing", "/healthz", "/"}) {
    const Reply reply = get(port(), url);
    EXPECT_EQ(reply.header("cross-origin-opener-policy"), "same-origin") << url;
    EXPECT_EQ(reply.header("cross-origin-embedder-policy"), "require-corp") << url;
    EXPECT_EQ(reply.header("x-content-type-options"), "nosniff") << url;
    EXPECT_NE(reply.header("content-security-policy").find("default-src 'none'"), std::string::npos) << url;
  }
}

TEST_F(Rest, AnswersRubbishAndWhatIsTooLargeAndGoesOn) {
  const auto send = [](const std::string& bytes) {
    Connection connection(port());
    connection.send(bytes);
    return readReply(connection);
  };
  expectProblem(send("rubbish\r\n\r\n"), 400);
  expectProblem(send("GET / HTTP/1.1\r\nHost 127.0.0.1\r\n\r\n"), 400);
  expectProblem(send("GET /%zz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"), 400);
  expectProblem(send("GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + std::string(20'000, 'x') + "\r\n\r\n"), 431);
  expectProblem(send("POST /api/v1/sessions HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 2000000\r\n\r\n"), 413);
  expectProblem(send("POST /api/v1/sessions HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: -1\r\n\r\n"), 400);
  {
    Connection cut(port());
    cut.send("GET /api/v1/cases HT");
  }
  EXPECT_EQ(get(port(), "/healthz").status, 200);
}

TEST_F(Rest, KeepsAConnectionForManyRequests) {
  Connection connection(port());
  for (int i = 0; i < 50; ++i) {
    connection.send(requestText({"GET", "/api/v1/cases"}));
    ASSERT_EQ(readReply(connection).status, 200) << "request " << i;
  }
  connection.send(requestText({"GET", "/healthz", "", {"Connection: close"}}));
  EXPECT_EQ(readReply(connection).status, 200);
  EXPECT_EQ(connection.receiveAll(), "");
}

TEST_F(Rest, SeesACaseThatAnotherProcessAdds) {
  auto store = store::Store::open(folder_->path()).value();
  const std::string id = store.addCase({}).value().id;
  EXPECT_EQ(get(port(), "/api/v1/cases/" + id).status, 200);
}

TEST(Serve, SaysWhatIsWrongWithItsAddressOrPages) {
  const TemporaryFolder folder;
  const std::string data = (folder.path() / "data").string();
  const Server first(data);
  const auto taken = run({"serve", "--data", data, "--port", std::to_string(first.port())});
  EXPECT_EQ(taken.code, 1);
  EXPECT_NE(taken.err.find("Address already in use"), std::string::npos) << taken.err;
  EXPECT_EQ(run({"serve", "--data", data, "--address", "nowhere"}).code, 1);
  EXPECT_EQ(run({"serve", "--data", data, "--web", (folder.path() / "missing").string()}).code, 1);
  EXPECT_EQ(run({"serve", "--data", data, "--port", "99999"}).code, 2);
}

TEST(Pages, AreServedWithTheirTypesAndNothingElseIs) {
  const TemporaryFolder folder;
  const auto web = folder.path() / "web";
  std::filesystem::create_directories(web / "assets");
  std::ofstream(folder.path() / "secret.txt") << "secret";
  std::ofstream(web / "index.html") << "<!doctype html>" << std::string(5000, ' ');
  std::ofstream(web / "assets" / "core-1a2b.wasm") << "wasm";
  std::ofstream(web / "assets" / "main-3c4d.js") << "js";
  std::filesystem::create_symlink(folder.path() / "secret.txt", web / "link.txt");
  const Server server((folder.path() / "data").string(), {"--web", web.string()});

  const Reply page = get(server.port(), "/", {"Accept-Encoding: gzip"});
  EXPECT_EQ(page.header("content-type"), "text/html; charset=utf-8");
  EXPECT_EQ(page.header("content-encoding"), "gzip");
  EXPECT_EQ(page.header("cache-control"), "no-cache");
  EXPECT_EQ(get(server.port(), "/", {"If-None-Match: " + page.header("etag")}).status, 304);
  const Reply wasm = get(server.port(), "/assets/core-1a2b.wasm");
  EXPECT_EQ(wasm.header("content-type"), "application/wasm");
  EXPECT_NE(wasm.header("cache-control").find("immutable"), std::string::npos);
  EXPECT_EQ(get(server.port(), "/assets/main-3c4d.js").header("content-type"), "text/javascript; charset=utf-8");

  std::ofstream(web / "index.html") << "new";  // built again while the server runs
  EXPECT_EQ(get(server.port(), "/").body, "new");
  for (const char* outside : {"/link.txt", "/../secret.txt", "/%2e%2e/secret.txt", "//etc/passwd", "/assets",
                              "/assets/../../secret.txt", "/index.html/", "/..%2fsecret.txt"}) {
    const Reply reply = get(server.port(), outside);
    EXPECT_TRUE(reply.status == 404 || reply.status == 400) << outside << " " << reply.status;
    EXPECT_EQ(reply.body.find("secret"), std::string::npos);
  }
}

}  // namespace
}  // namespace spinaltap::test
