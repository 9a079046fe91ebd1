// server/store/store.h - the data folder: spinaltap.db (SQLite) and the blobs beside it.
// Several processes and threads may use one folder; a Store may be shared between threads.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/plan/path.h"
#include "core/point_volume/lattice.h"
#include "core/volume/grid.h"
#include "server/store/blob_store.h"

namespace spinaltap::store {

enum class Stage { Imported, Segmented, Reconstructed };
[[nodiscard]] std::string_view nameOf(Stage stage);

/// Nothing here names a person: `label` is what the user called the case.
struct Case {
  std::string id, label, created;
  Stage stage = Stage::Imported;
  volume::Grid grid;
  std::string label_source;         ///< "" (no label yet), "imported" or "segmented"
  std::string figures_json = "{}";  ///< what reconstruct measured
  BlobId ct, label_blob, roi, model, mesh;
  int paths = 0, recordings = 0;  ///< counted when read; paths without the retired ones
};

struct Path {
  std::string id, case_id, label, created;
  plan::Path path;
  point_volume::Lattice lattice;
  std::uint64_t points_alive = 0;
  BlobId point_volume;
  bool drilled = false;          ///< somebody began to drill it: under this id it never changes again
  bool retired = false;          ///< replaced or deleted since; still there for what was drilled on it
  std::string replaced_by = {};  ///< the id that took its place; may be empty
};

struct Recording {
  std::string id, case_id, path_id, created;
  std::uint64_t cycles = 0;
  bool complete = false;
  std::string metrics_json = "{}";
  BlobId bytes;
};

struct Reconstruction {
  BlobId roi, model, mesh;
  std::string figures_json;
};

struct Options {
  Fault fault;  ///< for tests
};

/// Errors of every function: NotFound (naming the id), Io (the data base or the disk refused).
class Store {
 public:
  /// Makes or migrates the folder. @error Io, Unsupported (made by a newer version of the program).
  [[nodiscard]] static Result<Store> open(const std::filesystem::path& folder, const Options& options = {});
  Store(Store&&) noexcept;
  Store& operator=(Store&&) noexcept;
  ~Store();

  [[nodiscard]] BlobStore& blobs();
  [[nodiscard]] const std::filesystem::path& folder() const;

  /// `wanted.id` and `.created` are given here, whatever they held; the complete row is returned.
  [[nodiscard]] Result<Case> addCase(Case wanted);
  [[nodiscard]] Result<std::vector<Case>> cases();  ///< newest first
  [[nodiscard]] Result<Case> findCase(const std::string& id);
  [[nodiscard]] Result<void> setLabel(const std::string& case_id, const BlobId& label, const std::string& source);
  [[nodiscard]] Result<void> setReconstruction(const std::string& case_id, const Reconstruction& made);

  [[nodiscard]] Result<Path> addPath(Path wanted);
  [[nodiscard]] Result<std::vector<Path>> paths(const std::string& case_id);  ///< oldest first, none that is retired
  /// Retired ones too.
  [[nodiscard]] Result<Path> findPath(const std::string& case_id, const std::string& path_id);
  /// As findPath, and from now on it never changes under this id.
  [[nodiscard]] Result<Path> findPathToDrill(const std::string& case_id, const std::string& path_id);
  /// Puts `wanted` in the place of the path `wanted.id`. While nobody has drilled that, it keeps its id and its old
  /// points are removed; once somebody has, it is retired as it is, and the answer has a new id.
  /// @error NotFound also for a path that is retired already.
  [[nodiscard]] Result<Path> replacePath(Path wanted);
  /// Takes a path out of the plan: removed with its points, or retired when somebody has drilled it (the answer says).
  [[nodiscard]] Result<Path> removePath(const std::string& case_id, const std::string& path_id);

  /// Keeps `wanted.id` when it is not empty (a live recording has its name before it is finished).
  [[nodiscard]] Result<Recording> addRecording(Recording wanted);
  [[nodiscard]] Result<std::vector<Recording>> recordings(const std::string& case_id);  ///< newest first
  [[nodiscard]] Result<Recording> findRecording(const std::string& id);

 private:
  struct State;
  [[nodiscard]] Result<void> dropUnnamed(const BlobId& blob);
  explicit Store(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// `--data` when given, else $SPINALTAP_DATA, else $HOME/.local/share/spinaltap. @error InvalidArgument.
[[nodiscard]] Result<std::filesystem::path> dataFolder(const std::string& given);

}  // namespace spinaltap::store
