// What the child can no longer do once it parses, and how the parent sees it die.
#include <fcntl.h>

#include "server/import/child_process.h"
#include "server/import/sanitized.h"
#include "tests/server/import/made_files.h"

namespace spinaltap::importer {
namespace {

std::string outputOf(const std::vector<std::string>& arguments, ChildEnd& end) {
  std::string text;
  ChildStreams streams;
  streams.output = [&](std::span<const std::byte> bytes) {
    text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return true;
  };
  const auto result = runChild(defaultChildProgram(), arguments, {}, std::chrono::seconds(60), streams);
  EXPECT_TRUE(result.has_value());
  if (result) end = *result;
  return text;
}

TEST(Sandbox, ForbidsFilesSocketsProcessesAndCode) {
  ChildEnd end;
  const std::string text = outputOf({"--self-test-sandbox"}, end);
  EXPECT_EQ(end.exit_code, 0) << text;
  EXPECT_EQ(text.find("ALLOWED"), std::string::npos) << text;
  std::vector<std::string> trials{"open-to-write", "socket", "execve", "fork", "unlink", "kill"};
  if (SPINALTAP_SANITIZED == 0) {
    trials.insert(trials.end(), {"open-to-read", "read", "write-elsewhere", "ptrace", "executable-memory"});
  }
  for (const std::string& trial : trials) EXPECT_NE(text.find(trial + " forbidden"), std::string::npos) << text;
}

TEST(Sandbox, LeavesNothingOfTheParentOpenInTheChild) {
  // A descriptor without close-on-exec stands for the server's sockets and database.
  const int leak = open("/dev/null", O_RDONLY);
  ASSERT_GE(leak, 0);
  std::string text;
  ChildStreams streams;
  streams.output = [&](std::span<const std::byte> bytes) {
    text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return true;
  };
  const auto end = runChild("/bin/ls", {"/proc/self/fd"}, {}, std::chrono::seconds(60), streams);
  close(leak);
  ASSERT_TRUE(end.has_value());
  // Standard input and output, /dev/null or stderr, the progress pipe, and the folder that ls itself has open.
  EXPECT_EQ(text, "0\n1\n2\n3\n4\n");
}

TEST(Sandbox, GivesTheChildAnEmptyEnvironment) {
  std::string text;
  ChildStreams streams;
  streams.output = [&](std::span<const std::byte> bytes) {
    text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return true;
  };
  ASSERT_TRUE(runChild("/usr/bin/env", {}, {}, std::chrono::seconds(60), streams).has_value());
  EXPECT_EQ(text, "");
}

TEST(Sandbox, KillsAChildThatOutstaysItsDeadline) {
  ChildStreams streams;
  streams.output = [](std::span<const std::byte>) { return true; };
  const auto end = runChild("/bin/sleep", {"1000"}, {}, std::chrono::milliseconds(50), streams);
  ASSERT_TRUE(end.has_value());
  EXPECT_TRUE(end->timed_out);
  EXPECT_EQ(end->signal, SIGKILL);
}

TEST(Sandbox, KillsAChildThatClosedItsPipesButLivesOn) {
  ChildStreams streams;
  streams.output = [](std::span<const std::byte>) { return true; };
  const auto end =
      runChild("/bin/sh", {"-c", "exec >&- 3>&- 2>&-; exec sleep 1000"}, {}, std::chrono::milliseconds(300), streams);
  ASSERT_TRUE(end.has_value());
  EXPECT_TRUE(end->timed_out);
}

/// Programs that are no importer: whatever they do, one clean line comes out.
TEST(Sandbox, SurvivesAChildThatIsNotTheImporter) {
  const Scratch scratch;
  ImportRequest request;
  request.from = scratch.write("x.dcm", part10(madeSlice(0)));
  for (const char* program :
       {"/bin/true", "/bin/false", "/bin/cat", "/usr/bin/yes", "/nowhere/at/all", "/etc/passwd"}) {
    if (SPINALTAP_SANITIZED != 0 && std::string(program) == "/bin/false") continue;  // looks like a sanitizer's exit
    request.program = program;
    const auto result = importVolume(request);
    ASSERT_FALSE(result.has_value()) << program;
    expectClean(result.error());
  }
}

}  // namespace
}  // namespace spinaltap::importer
