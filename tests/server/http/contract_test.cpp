// server/contract/openapi.json against the running server: every documented route answers, with the documented keys.
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "server/jobs/drill_job.h"
#include "tests/server/program.h"
#include "tests/server/small_case.h"
#include "tests/server/sockets.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::test {
namespace {
using nlohmann::json;

class Contract : public testing::Test {
 protected:
  json document_ = json::parse(std::ifstream(SPINALTAP_CONTRACT "/openapi.json"));

  [[nodiscard]] const json& resolve(const json& schema) const {
    return schema.contains("$ref") ? document_.at(json::json_pointer(schema["$ref"].get<std::string>().substr(1)))
                                   : schema;
  }

  /// The part of JSON Schema that the contract uses; keys that are not documented are faults too.
  void expectMatches(const json& value, const json& schema_or_ref, const std::string& where) const {
    const json& schema = resolve(schema_or_ref);
    const std::string type = schema.value("type", "");
    EXPECT_TRUE(type != "number" || value.is_number()) << where;
    EXPECT_TRUE(type != "integer" || value.is_number_integer()) << where << " " << value;
    EXPECT_TRUE(type != "string" || value.is_string()) << where;
    EXPECT_TRUE(type != "boolean" || value.is_boolean()) << where;
    if (type == "array") expectArray(value, schema, where);
    if (type == "object") expectObject(value, schema, where);
    if (schema.contains("enum")) {
      const json& allowed = schema["enum"];
      EXPECT_NE(std::find(allowed.begin(), allowed.end(), value), allowed.end()) << where;
    }
  }
  void expectArray(const json& value, const json& schema, const std::string& where) const {
    ASSERT_TRUE(value.is_array()) << where;
    EXPECT_GE(value.size(), schema.value("minItems", std::size_t{0})) << where;
    EXPECT_LE(value.size(), schema.value("maxItems", SIZE_MAX)) << where;
    for (std::size_t i = 0; i < value.size(); ++i)
      expectMatches(value[i], schema["items"], where + "/" + std::to_string(i));
  }
  void expectObject(const json& value, const json& schema, const std::string& where) const {
    ASSERT_TRUE(value.is_object()) << where;
    if (!schema.contains("properties")) return;
    for (const auto& key : schema["required"]) EXPECT_TRUE(value.contains(key)) << where << " lacks " << key;
    for (const auto& [key, item] : value.items()) {
      ASSERT_TRUE(schema["properties"].contains(key)) << where << "/" << key << " is not documented";
      expectMatches(item, schema["properties"][key], where + "/" + key);
    }
  }
};

TEST_F(Contract, EveryDocumentedRouteAnswersWithTheDocumentedKeys) {
  const TemporaryFolder folder;
  SmallCase small;
  std::string recording;
  {
    auto store = store::Store::open(folder.path()).value();
    small = makeSmallCase(store);
    jobs::DrillJob job;
    job.scene = session::Scene::On;
    job.keep = true;
    recording = jobs::drill(&store, jobs::siteOfPath(store, small.case_id, small.path_id).value(), job, {})
                    .value()["recording_id"];
  }
  const Server server(folder.path().string());
  const json path{{"entry_patient", {0, 0, 0}}, {"target_patient", {0, 0, 3}}, {"spacing_mm", 0.5}};
  const json bodies{{"addPath", path},
                    {"replacePath", path},
                    {"addSession", {{"case_id", small.case_id}, {"path_id", small.path_id}}}};
  for (const auto& [pattern, item] : document_["paths"].items()) {
    std::string url = pattern;
    for (const auto& [name, value] : std::map<std::string, std::string>{
             {"{id}", small.case_id}, {"{path_id}", small.path_id}, {"{recording_id}", recording}}) {
      if (const auto at = url.find(name); at != std::string::npos) url.replace(at, name.size(), value);
    }
    for (const std::string method : {"get", "post", "put", "delete"}) {
      if (!item.contains(method)) continue;
      const json& operation = item[method];
      const std::string success = operation["responses"].begin().key();
      // The path was drilled: changed or deleted, it stays where it was.
      std::string verb = method;
      for (char& c : verb) c = static_cast<char>(c - 'a' + 'A');
      const json body = bodies.value(operation["operationId"].get<std::string>(), json());
      if (method == "delete") url = post(server.port(), url.substr(0, url.rfind('/')), path).header("location");
      const Reply reply = body.is_null()
                              ? ask(server.port(), {verb, url})
                              : ask(server.port(), {verb, url, body.dump(), {"Content-Type: application/json"}});
      EXPECT_EQ(std::to_string(reply.status), success) << url << " " << reply.body.substr(0, 200);
      const json& content = operation["responses"][success]["content"];
      ASSERT_TRUE(content.contains(reply.header("content-type"))) << url;
      if (content.contains("application/json")) {
        expectMatches(reply.json(), content["application/json"]["schema"], url);
      }
    }
  }
}

TEST_F(Contract, ProblemsHaveTheDocumentedKeysAndStatus) {
  const TemporaryFolder folder;
  const Server server(folder.path().string());
  const Reply reply = get(server.port(), "/api/v1/cases/czzzzzzz");
  EXPECT_TRUE(document_["paths"]["/api/v1/cases/{id}"]["get"]["responses"].contains(std::to_string(reply.status)));
  expectMatches(reply.json(), document_["components"]["schemas"]["Problem"], "problem");
}

TEST_F(Contract, EveryReferenceLeadsSomewhere) {
  const std::function<void(const json&)> visit = [&](const json& node) {
    if (node.is_object() && node.contains("$ref")) {
      EXPECT_NO_THROW(std::ignore = resolve(node)) << node;
    }
    if (node.is_structured()) {
      for (const json& child : node) visit(child);
    }
  };
  visit(document_);
}

}  // namespace
}  // namespace spinaltap::test
