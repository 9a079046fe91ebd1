// spinaltap-import: the one program that links a DICOM parser. Started by server/import/import.cpp, which gives it
// pipes and nothing else; see protocol.h for what it says and sandbox.h for what it gives up first.
#include <gdcmTrace.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <new>

#include "server/import/child/import_kinds.h"
#include "server/import/child/input_files.h"
#include "server/import/child/output.h"
#include "server/import/child/sandbox.h"
#include "server/import/protocol.h"

namespace spinaltap::importer {
namespace {

std::vector<std::byte> readStandardInput() {
  constexpr std::size_t kLongest = 65536;
  std::vector<std::byte> bytes(kLongest);
  std::size_t size = 0;
  while (size < kLongest) {
    const ssize_t got = read(STDIN_FILENO, bytes.data() + size, kLongest - size);
    if (got <= 0) break;
    size += static_cast<std::size_t>(got);
  }
  bytes.resize(size);
  return bytes;
}

Result<void> run(Output& output) {
  auto request = decodeRequest(readStandardInput());
  if (!request) return tl::unexpected(request.error());
  limitResources(request->limits);
  auto input = readInput(*request);
  if (!input) return tl::unexpected(input.error());
  const std::uint64_t label_bytes = request->label ? 2 * request->limits.voxels : 0;
  if (auto shut = enterSandbox(request->limits, input->total_bytes, label_bytes); !shut) return shut;
  return input->kind == InputKind::Nifti ? importNifti(*input, *request, output)
                                         : importDicom(*input, *request, output);
}

int runToEnd() {
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  Output output;
  Result<void> done;
  try {
    done = run(output);
  } catch (const std::bad_alloc&) {
    done = fail(ErrorCode::Limit, fileInWork() + ": asks for more memory than its size allows");
  } catch (const std::exception&) {
    done = fail(ErrorCode::Corrupt, fileInWork() + ": broken in a way its parser did not expect");
  }
  if (done) {
    output.end();
  } else {
    output.refused(done.error());
  }
  return 0;
}

}  // namespace
}  // namespace spinaltap::importer

int main(int argc, char** argv) {
  if (argc == 2 && std::strcmp(argv[1], "--self-test-sandbox") == 0) return spinaltap::importer::testSandbox();
  if (argc != 1 || isatty(STDIN_FILENO) != 0) {
    std::fputs("spinaltap-import is started by `spinaltap import`; it takes its request on standard input.\n", stderr);
    return 2;
  }
  // No destructors: what a broken file left in a parser's heap is not touched again.
  _exit(spinaltap::importer::runToEnd());
}
