
#include "server/cli/commands.h"
#include "server/jobs/drill_job.h"
#include "server/store/ids.h"

namespace spinaltap::cli {
namespace {

/// A file of that name, else a recording of the data folder.
Result<std::vector<std::byte>> bytesOf(const ReplayOptions& options) {
  if (std::filesystem::exists(options.file) || !store::isId(options.file)) return store::readFile(options.file);
  auto store = openStore(options.data);
  if (!store) return tl::unexpected(store.error());
  const auto row = store->findRecording(options.file);
  if (!row) return tl::unexpected(row.error());
  return store->blobs().get(row->bytes);
}

}  // namespace

Result<Outcome> runReplay(const ReplayOptions& options, ProgressBar& bar) {
  const auto bytes = bytesOf(options);
  if (!bytes) return tl::unexpected(bytes.error());
  auto figures = jobs::replay(*bytes, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  const bool verified = (*figures)["verified"].get<bool>();
  return Outcome{std::move(*figures), verified};
}

}  // namespace spinaltap::cli
