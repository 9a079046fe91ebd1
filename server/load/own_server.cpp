#include "server/load/own_server.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <vector>

#include "core/session/scenes.h"
#include "core/wire/mesh_message.h"
#include "server/jobs/codec.h"
#include "server/jobs/plan_job.h"

namespace spinaltap::load {
namespace fs = std::filesystem;
namespace {

/// The report's path into bone that fills z > 0: as many points as a real one, made in a second.
Result<Target> makeCase(const fs::path& folder) {
  auto store = store::Store::open(folder);
  if (!store) return tl::unexpected(store.error());
  volume::CtVolume ct;
  ct.grid.dims = {12, 12, 50};
  ct.grid.origin_patient = {-6, -6, -5};
  ct.hu.assign(ct.grid.voxels(), 300);
  const volume::LabelVolume label{ct.grid, std::vector<std::uint8_t>(ct.grid.voxels(), 1)};
  rbf::Model model;
  model.linear = {0, 0, -1};
  store::Case row;
  row.label = "load";
  row.grid = ct.grid;
  const auto ct_blob = store->blobs().put(jobs::encodeCt(ct)),
             label_blob = store->blobs().put(jobs::encodeLabel(label));
  const auto model_blob = store->blobs().put(jobs::encodeModel(model));
  const auto mesh_blob = store->blobs().put(wire::encodeMesh(mesh::TriangleMesh{}));
  if (!ct_blob || !label_blob || !model_blob || !mesh_blob) return fail(ErrorCode::Io, "load: cannot write a case");
  row.ct = *ct_blob;
  const auto made = store->addCase(row);
  if (!made) return tl::unexpected(made.error());
  if (auto set = store->setLabel(made->id, *label_blob, "segmented"); !set) return tl::unexpected(set.error());
  const store::Reconstruction reconstruction{*ct_blob, *model_blob, *mesh_blob, "{}"};
  if (auto set = store->setReconstruction(made->id, reconstruction); !set) return tl::unexpected(set.error());
  plan::Path path;
  path.target_patient = {0, 0, session::kReportLength_mm};
  path.bit = session::reportBit();
  path.volume_radius_mm = 3;
  const auto planned = jobs::planPath(*store, {made->id, "load", path}, {});
  if (!planned) return tl::unexpected(planned.error());
  Target target;
  target.case_id = made->id, target.path_id = planned->id;
  return target;
}

/// The word that follows `key` in a file of /proc.
long numberAfter(const std::string& file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(key, 0) == 0) return std::atol(line.c_str() + key.size());
  }
  return 0;
}

std::string readLine(int handle) {
  std::string line;
  for (char c = 0; ::read(handle, &c, 1) == 1 && c != '\n';) line += c;
  return line;
}

}  // namespace

Result<std::unique_ptr<OwnServer>> OwnServer::start(bool realtime) {
  std::unique_ptr<OwnServer> server(new OwnServer);
  std::string name = (fs::temp_directory_path() / "spinaltap-load-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) return fail(ErrorCode::Io, "load: cannot make a temporary folder");
  server->folder_ = name;
  auto target = makeCase(server->folder_);
  if (!target) return tl::unexpected(target.error());
  server->target_ = *target;
  if (const auto launched = server->launch(realtime); !launched) return tl::unexpected(launched.error());
  return server;
}

Result<void> OwnServer::launch(bool realtime) {
  std::array<int, 2> out{};
  if (::pipe2(out.data(), O_CLOEXEC) != 0) return fail(ErrorCode::Io, "load: cannot start a server");
  const std::string folder = folder_.string();
  std::vector<const char*> arguments{"spinaltap", "serve", "--port", "0", "--data", folder.c_str()};
  if (realtime) arguments.push_back("--realtime");
  arguments.push_back(nullptr);
  process_ = ::fork();
  if (process_ == 0) {
    ::dup2(out[1], STDOUT_FILENO);
    ::dup2(::open("/dev/null", O_WRONLY | O_CLOEXEC), STDERR_FILENO);
    ::execv("/proc/self/exe", const_cast<char**>(arguments.data()));
    ::_exit(127);
  }
  ::close(out[1]);
  const std::string line = readLine(out[0]);
  if (realtime) realtime_line_ = readLine(out[0]);
  ::close(out[0]);
  const auto colon = line.rfind(':');
  target_.server.port =
      colon == std::string::npos ? 0 : static_cast<std::uint16_t>(std::atoi(line.c_str() + colon + 1));
  if (target_.server.port == 0) return fail(ErrorCode::Io, "load: the server did not start");
  return {};
}

OwnServer::~OwnServer() {
  if (process_ > 0) {
    ::kill(process_, SIGTERM);
    ::waitpid(process_, nullptr, 0);
  }
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

double OwnServer::cpu_s() const {
  std::ifstream in("/proc/" + std::to_string(process_) + "/stat");
  std::string text((std::istreambuf_iterator<char>(in)), {});
  // after the name in brackets: state and 10 more, then user and system time in ticks
  std::size_t at = text.rfind(')');
  for (int field = 0; field < 12 && at != std::string::npos; ++field) at = text.find(' ', at + 1);
  if (at == std::string::npos) return 0;
  char* rest = nullptr;
  const double user = std::strtod(text.c_str() + at, &rest), system = std::strtod(rest, nullptr);
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

long OwnServer::memory_KiB() const { return numberAfter("/proc/" + std::to_string(process_) + "/status", "VmRSS:"); }

}  // namespace spinaltap::load
