#include "server/store/store.h"

#include <soci/soci.h>
// before any sqlite3.h: SOCI's header includes it itself, inside a namespace of its own
#include <soci/sqlite3/soci-sqlite3.h>

#include <cstdlib>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "server/store/ids.h"
#include "server/store/rows.h"
#include "server/store/schema.h"

namespace spinaltap::store {
namespace fs = std::filesystem;
using nlohmann::json;
using soci::into;
using soci::use;

struct Store::State {
  std::mutex mutex;
  fs::path folder;
  BlobStore blobs;
  soci::session sql;
};

namespace {

/// One place where the data base's exceptions become errors.
template <class F>
auto guarded(const char* what, F&& body) -> decltype(body()) {
  try {
    return body();
  } catch (const soci::soci_error& e) {
    return fail(ErrorCode::Io, std::string("data base: ") + what + ": " + e.get_error_message());
  } catch (const json::exception&) {
    return fail(ErrorCode::Corrupt,
                std::string("data base: ") + what + ": a row holds what this program did not write");
  }
}

int schemaVersion(soci::session& sql) {
  int tables = 0, version = 0;
  sql << "SELECT COUNT(*) FROM sqlite_master WHERE type='table' AND name='schema_version'", into(tables);
  if (tables > 0) sql << "SELECT version FROM schema_version", into(version);
  return version;
}

Result<void> migrate(soci::session& sql) {
  if (schemaVersion(sql) == kSchemaVersion) return {};
  sql << "BEGIN IMMEDIATE";  // another process may be migrating: wait for it, then look again
  try {
    int version = schemaVersion(sql);
    if (version > kSchemaVersion) {
      sql << "ROLLBACK";
      return fail(ErrorCode::Unsupported, "data folder: made by a newer version of spinaltap (schema " +
                                              std::to_string(version) + ", this program knows " +
                                              std::to_string(kSchemaVersion) + ")");
    }
    if (version == 0) {
      sql << "CREATE TABLE IF NOT EXISTS schema_version (version INTEGER NOT NULL)";
      sql << "INSERT INTO schema_version VALUES (0)";
    }
    for (; version < kSchemaVersion; ++version) {
      for (const char* statement : kMigrations[static_cast<std::size_t>(version)]) {
        if (statement != nullptr) sql << statement;
      }
    }
    sql << "UPDATE schema_version SET version = :v", use(version);
    sql << "COMMIT";
  } catch (const soci::soci_error&) {
    sql << "ROLLBACK";
    throw;
  }
  return {};
}

/// The switch to WAL needs the file for itself for a moment and does not wait for it: try for two seconds.
void switchToWal(soci::session& sql) {
  for (int attempt = 0;; ++attempt) {
    try {
      std::string mode;
      sql << "PRAGMA journal_mode = WAL", into(mode);
      return;
    } catch (const soci::soci_error&) {
      if (attempt == 40) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
}

void connect(soci::session& sql, const fs::path& file) {
  sql.open(soci::sqlite3, "dbname=\"" + file.string() + "\" timeout=10");
  switchToWal(sql);
  sql << "PRAGMA synchronous = FULL";
  sql << "PRAGMA foreign_keys = ON";
}

constexpr const char* kCaseColumns =
    "SELECT id, label, created, stage, grid, label_source, figures, ct, label_blob, roi, model, mesh,"
    " (SELECT COUNT(*) FROM paths WHERE case_id = cases.id AND retired = 0),"
    " (SELECT COUNT(*) FROM recordings WHERE case_id = cases.id) FROM cases ";

std::vector<Case> selectCases(soci::session& sql, const std::string& where, const std::string& id) {
  Case row;
  int stage = 0;
  std::string grid;
  soci::statement query =
      (sql.prepare << kCaseColumns + where, into(row.id), into(row.label), into(row.created), into(stage), into(grid),
       into(row.label_source), into(row.figures_json), into(row.ct), into(row.label_blob), into(row.roi),
       into(row.model), into(row.mesh), into(row.paths), into(row.recordings), use(id, "id"));
  std::vector<Case> rows;
  for (bool more = query.execute(true); more; more = query.fetch()) {
    row.stage = static_cast<Stage>(stage);
    row.grid = gridFrom(json::parse(grid));
    rows.push_back(row);
  }
  return rows;
}

json definitionOf(const Path& row) {
  return {{"entry_patient", toJson(row.path.entry_patient)},
          {"target_patient", toJson(row.path.target_patient)},
          {"bit", toJson(row.path.bit)},
          {"volume_radius_mm", row.path.volume_radius_mm},
          {"lead_mm", row.path.lead_mm},
          {"spacing_mm", row.path.spacing_mm},
          {"lattice", toJson(row.lattice)}};
}

void readDefinition(const json& definition, Path& row) {
  row.path.entry_patient = vec3From(definition.at("entry_patient"));
  row.path.target_patient = vec3From(definition.at("target_patient"));
  row.path.bit = bitFrom(definition.at("bit"));
  row.path.volume_radius_mm = definition.at("volume_radius_mm").get<double>();
  row.path.lead_mm = definition.at("lead_mm").get<double>();
  row.path.spacing_mm = definition.at("spacing_mm").get<double>();
  row.lattice = latticeFrom(definition.at("lattice"));
}

std::vector<Path> selectPaths(soci::session& sql, const std::string& where, const std::string& id) {
  Path row;
  std::string definition;
  long long alive = 0;
  int drilled = 0, retired = 0;
  soci::statement query =
      (sql.prepare << "SELECT id, case_id, label, created, definition, points_alive, point_volume,"
                      " drilled, retired, replaced_by FROM paths " +
                          where,
       into(row.id), into(row.case_id), into(row.label), into(row.created), into(definition), into(alive),
       into(row.point_volume), into(drilled), into(retired), into(row.replaced_by), use(id, "id"));
  std::vector<Path> rows;
  for (bool more = query.execute(true); more; more = query.fetch()) {
    readDefinition(json::parse(definition), row);
    row.points_alive = static_cast<std::uint64_t>(alive);
    row.drilled = drilled != 0, row.retired = retired != 0;
    rows.push_back(row);
  }
  return rows;
}

std::vector<Recording> selectRecordings(soci::session& sql, const std::string& where, const std::string& id) {
  Recording row;
  long long cycles = 0;
  int complete = 0;
  soci::statement query =
      (sql.prepare << "SELECT id, case_id, path_id, created, cycles, complete, metrics, bytes FROM recordings " + where,
       into(row.id), into(row.case_id), into(row.path_id), into(row.created), into(cycles), into(complete),
       into(row.metrics_json), into(row.bytes), use(id, "id"));
  std::vector<Recording> rows;
  for (bool more = query.execute(true); more; more = query.fetch()) {
    row.cycles = static_cast<std::uint64_t>(cycles);
    row.complete = complete != 0;
    rows.push_back(row);
  }
  return rows;
}

/// A new id, of today, in nobody's place.
void insertPath(soci::session& sql, Path& wanted) {
  wanted.id = randomId('p');
  wanted.created = timestamp();
  wanted.drilled = wanted.retired = false;
  wanted.replaced_by.clear();
  const std::string definition = definitionOf(wanted).dump();
  const auto alive = static_cast<long long>(wanted.points_alive);
  sql << "INSERT INTO paths (id, case_id, label, created, definition, points_alive, point_volume)"
         " VALUES (:id, :case, :label, :created, :definition, :alive, :volume)",
      use(wanted.id), use(wanted.case_id), use(wanted.label), use(wanted.created), use(definition), use(alive),
      use(wanted.point_volume);
}

void retirePath(soci::session& sql, const std::string& id, const std::string& replaced_by) {
  sql << "UPDATE paths SET retired = 1, replaced_by = :by WHERE id = :id", use(replaced_by), use(id);
}

/// All of `body` or nothing; other processes that write wait meanwhile.
template <class F>
auto inTransaction(soci::session& sql, F&& body) -> decltype(body()) {
  sql << "BEGIN IMMEDIATE";
  try {
    auto result = body();
    sql << (result ? "COMMIT" : "ROLLBACK");
    return result;
  } catch (...) {
    sql << "ROLLBACK";
    throw;
  }
}

/// Shown in messages: never more of a caller's text than an id is long.
std::string shown(const std::string& id) { return isId(id) ? id : "(not an id)"; }

template <class Row>
Result<Row> only(std::vector<Row> rows, const char* kind, const std::string& id) {
  if (rows.empty()) return fail(ErrorCode::NotFound, std::string("there is no ") + kind + " " + shown(id));
  return std::move(rows.front());
}

Result<Path> pathOfCase(soci::session& sql, const std::string& case_id, const std::string& path_id) {
  auto found = only(selectPaths(sql, "WHERE id = :id", path_id), "path", path_id);
  if (found && found->case_id != case_id) {
    return fail(ErrorCode::NotFound, "path " + shown(path_id) + " is not one of case " + shown(case_id));
  }
  return found;
}

Result<Path> plannedPath(soci::session& sql, const std::string& case_id, const std::string& path_id) {
  auto found = pathOfCase(sql, case_id, path_id);
  if (found && found->retired) {
    return fail(ErrorCode::NotFound, "path " + path_id + " is no longer in the plan" +
                                         (found->replaced_by.empty() ? "" : ": path " + found->replaced_by + " is"));
  }
  return found;
}

}  // namespace

std::string_view nameOf(Stage stage) {
  switch (stage) {
    case Stage::Imported:
      return "imported";
    case Stage::Segmented:
      return "segmented";
    default:
      return "reconstructed";
  }
}

Store::Store(std::unique_ptr<State> state) : state_(std::move(state)) {}
Store::Store(Store&&) noexcept = default;
Store& Store::operator=(Store&&) noexcept = default;
Store::~Store() = default;

BlobStore& Store::blobs() { return state_->blobs; }
const fs::path& Store::folder() const { return state_->folder; }

Result<Store> Store::open(const fs::path& folder, const Options& options) {
  std::error_code error;
  fs::create_directories(folder / "live", error);
  if (error) return fail(ErrorCode::Io, "data folder: cannot make it: " + error.message());
  if (folder.string().find('"') != std::string::npos) {
    return fail(ErrorCode::InvalidArgument, "data folder: its name holds a double quote");
  }
  auto blobs = BlobStore::open(folder / "blobs", options.fault);
  if (!blobs) return tl::unexpected(blobs.error());
  return guarded("opening", [&]() -> Result<Store> {
    std::unique_ptr<State> state(new State{{}, folder, std::move(*blobs), {}});
    connect(state->sql, folder / "spinaltap.db");
    if (const auto migrated = migrate(state->sql); !migrated) return tl::unexpected(migrated.error());
    return Store(std::move(state));
  });
}

Result<Case> Store::addCase(Case wanted) {
  const std::scoped_lock lock(state_->mutex);
  return guarded("adding a case", [&]() -> Result<Case> {
    wanted.id = randomId('c');
    wanted.created = timestamp();
    const int stage = static_cast<int>(wanted.stage);
    const std::string grid = toJson(wanted.grid).dump();
    state_->sql << "INSERT INTO cases VALUES (:id, :label, :created, :stage, :grid, :source, :figures,"
                   " :ct, :label_blob, :roi, :model, :mesh)",
        use(wanted.id), use(wanted.label), use(wanted.created), use(stage), use(grid), use(wanted.label_source),
        use(wanted.figures_json), use(wanted.ct), use(wanted.label_blob), use(wanted.roi), use(wanted.model),
        use(wanted.mesh);
    return wanted;
  });
}

Result<std::vector<Case>> Store::cases() {
  const std::scoped_lock lock(state_->mutex);
  return guarded("listing cases", [&]() -> Result<std::vector<Case>> {
    return selectCases(state_->sql, "WHERE :id = '' ORDER BY created DESC, rowid DESC", "");
  });
}

Result<Case> Store::findCase(const std::string& id) {
  const std::scoped_lock lock(state_->mutex);
  return guarded("finding a case", [&] { return only(selectCases(state_->sql, "WHERE id = :id", id), "case", id); });
}

Result<void> Store::setLabel(const std::string& case_id, const BlobId& label, const std::string& source) {
  const std::scoped_lock lock(state_->mutex);
  return guarded("keeping a label", [&]() -> Result<void> {
    const int stage = static_cast<int>(Stage::Segmented);
    soci::statement update = (state_->sql.prepare << "UPDATE cases SET label_blob = :label, label_source = :source,"
                                                     " stage = MAX(stage, :stage) WHERE id = :id",
                              use(label), use(source), use(stage), use(case_id));
    update.execute(true);
    if (update.get_affected_rows() == 0) return fail(ErrorCode::NotFound, "there is no case " + shown(case_id));
    return {};
  });
}

Result<void> Store::setReconstruction(const std::string& case_id, const Reconstruction& made) {
  const std::scoped_lock lock(state_->mutex);
  return guarded("keeping a reconstruction", [&]() -> Result<void> {
    const int stage = static_cast<int>(Stage::Reconstructed);
    soci::statement update =
        (state_->sql.prepare << "UPDATE cases SET roi = :roi, model = :model, mesh = :mesh,"
                                " figures = :figures, stage = :stage WHERE id = :id",
         use(made.roi), use(made.model), use(made.mesh), use(made.figures_json), use(stage), use(case_id));
    update.execute(true);
    if (update.get_affected_rows() == 0) return fail(ErrorCode::NotFound, "there is no case " + shown(case_id));
    return {};
  });
}

Result<Path> Store::addPath(Path wanted) {
  const std::scoped_lock lock(state_->mutex);
  return guarded("adding a path", [&]() -> Result<Path> {
    if (selectCases(state_->sql, "WHERE id = :id", wanted.case_id).empty()) {
      return fail(ErrorCode::NotFound, "there is no case " + shown(wanted.case_id));
    }
    insertPath(state_->sql, wanted);
    return wanted;
  });
}

Result<std::vector<Path>> Store::paths(const std::string& case_id) {
  const std::scoped_lock lock(state_->mutex);
  return guarded("listing paths", [&]() -> Result<std::vector<Path>> {
    return selectPaths(state_->sql, "WHERE case_id = :id AND retired = 0 ORDER BY rowid", case_id);
  });
}

Result<Path> Store::findPath(const std::string& case_id, const std::string& path_id) {
  const std::scoped_lock lock(state_->mutex);
  return guarded("finding a path", [&] { return pathOfCase(state_->sql, case_id, path_id); });
}

Result<Path> Store::findPathToDrill(const std::string& case_id, const std::string& path_id) {
  const std::scoped_lock lock(state_->mutex);
  return guarded("finding a path to drill", [&] {
    return inTransaction(state_->sql, [&]() -> Result<Path> {
      auto found = pathOfCase(state_->sql, case_id, path_id);
      if (!found || found->drilled) return found;
      state_->sql << "UPDATE paths SET drilled = 1 WHERE id = :id", use(path_id);
      found->drilled = true;
      return found;
    });
  });
}

Result<Path> Store::replacePath(Path wanted) {
  const std::scoped_lock lock(state_->mutex);
  BlobId old_points;
  auto replaced = guarded("replacing a path", [&] {
    return inTransaction(state_->sql, [&]() -> Result<Path> {
      auto old = plannedPath(state_->sql, wanted.case_id, wanted.id);
      if (!old) return old;
      if (old->drilled) {
        insertPath(state_->sql, wanted);
        retirePath(state_->sql, old->id, wanted.id);
        return wanted;
      }
      old_points = old->point_volume;
      wanted.created = old->created;
      const std::string definition = definitionOf(wanted).dump();
      const auto alive = static_cast<long long>(wanted.points_alive);
      state_->sql << "UPDATE paths SET label = :label, definition = :definition, points_alive = :alive,"
                     " point_volume = :volume WHERE id = :id",
          use(wanted.label), use(definition), use(alive), use(wanted.point_volume), use(wanted.id);
      return wanted;
    });
  });
  if (!replaced || old_points.empty()) return replaced;
  if (const auto dropped = dropUnnamed(old_points); !dropped) return tl::unexpected(dropped.error());
  return replaced;
}

Result<Path> Store::removePath(const std::string& case_id, const std::string& path_id) {
  const std::scoped_lock lock(state_->mutex);
  auto removed = guarded("removing a path", [&] {
    return inTransaction(state_->sql, [&]() -> Result<Path> {
      auto row = plannedPath(state_->sql, case_id, path_id);
      if (!row) return row;
      row->retired = true;
      if (row->drilled) {
        retirePath(state_->sql, path_id, "");
      } else {
        state_->sql << "DELETE FROM paths WHERE id = :id", use(path_id);
      }
      return row;
    });
  });
  if (!removed || removed->drilled) return removed;
  if (const auto dropped = dropUnnamed(removed->point_volume); !dropped) return tl::unexpected(dropped.error());
  return removed;
}

/// In a transaction of its own, after the one that made it superfluous: a row must never name what is gone. Who puts
/// the same bytes again looks for them after its own row is written (jobs::planPath).
Result<void> Store::dropUnnamed(const BlobId& blob) {
  return guarded("dropping old points", [&] {
    return inTransaction(state_->sql, [&]() -> Result<void> {
      int named = 0;
      state_->sql << "SELECT (SELECT COUNT(*) FROM paths WHERE point_volume = :a)"
                     " + (SELECT COUNT(*) FROM recordings WHERE bytes = :b)"
                     " + (SELECT COUNT(*) FROM cases WHERE :c IN (ct, label_blob, roi, model, mesh))",
          into(named), use(blob), use(blob), use(blob);
      if (named == 0) state_->blobs.remove(blob);
      return {};
    });
  });
}

Result<Recording> Store::addRecording(Recording wanted) {
  const std::scoped_lock lock(state_->mutex);
  return guarded("adding a recording", [&]() -> Result<Recording> {
    if (selectPaths(state_->sql, "WHERE id = :id", wanted.path_id).empty()) {
      return fail(ErrorCode::NotFound, "there is no path " + shown(wanted.path_id));
    }
    state_->sql << "UPDATE paths SET drilled = 1 WHERE id = :id", use(wanted.path_id);
    if (wanted.id.empty()) wanted.id = randomId('r');
    wanted.created = timestamp();
    const auto cycles = static_cast<long long>(wanted.cycles);
    const int complete = wanted.complete ? 1 : 0;
    state_->sql << "INSERT INTO recordings VALUES (:id, :case, :path, :created, :cycles, :complete, :metrics, :bytes)",
        use(wanted.id), use(wanted.case_id), use(wanted.path_id), use(wanted.created), use(cycles), use(complete),
        use(wanted.metrics_json), use(wanted.bytes);
    return wanted;
  });
}

Result<std::vector<Recording>> Store::recordings(const std::string& case_id) {
  const std::scoped_lock lock(state_->mutex);
  return guarded("listing recordings", [&]() -> Result<std::vector<Recording>> {
    return selectRecordings(state_->sql, "WHERE case_id = :id ORDER BY rowid DESC", case_id);
  });
}

Result<Recording> Store::findRecording(const std::string& id) {
  const std::scoped_lock lock(state_->mutex);
  return guarded("finding a recording",
                 [&] { return only(selectRecordings(state_->sql, "WHERE id = :id", id), "recording", id); });
}

Result<fs::path> dataFolder(const std::string& given) {
  if (!given.empty()) return fs::path(given);
  if (const char* set = std::getenv("SPINALTAP_DATA"); set != nullptr && *set != '\0') return fs::path(set);
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    return fs::path(home) / ".local" / "share" / "spinaltap";
  }
  return fail(ErrorCode::InvalidArgument, "data folder: give --data, or set SPINALTAP_DATA or HOME");
}

}  // namespace spinaltap::store
