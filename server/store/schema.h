// server/store/schema.h - the tables, and how older data folders become today's.
#pragma once
#include <array>

namespace spinaltap::store {

/// kMigrations[v] brings a folder from version v to v + 1. Published entries are never edited: append.
/// Each is a list of statements, ended by nullptr.
inline constexpr int kSchemaVersion = 2;
inline constexpr std::array<std::array<const char*, 6>, kSchemaVersion> kMigrations{{
    {"CREATE TABLE cases ("
     " id TEXT PRIMARY KEY, label TEXT NOT NULL, created TEXT NOT NULL, stage INTEGER NOT NULL,"
     " grid TEXT NOT NULL, label_source TEXT NOT NULL, figures TEXT NOT NULL,"
     " ct TEXT NOT NULL, label_blob TEXT NOT NULL, roi TEXT NOT NULL, model TEXT NOT NULL, mesh TEXT NOT NULL)",
     "CREATE TABLE paths ("
     " id TEXT PRIMARY KEY, case_id TEXT NOT NULL REFERENCES cases(id), label TEXT NOT NULL, created TEXT NOT NULL,"
     " definition TEXT NOT NULL, points_alive INTEGER NOT NULL, point_volume TEXT NOT NULL)",
     "CREATE TABLE recordings ("
     " id TEXT PRIMARY KEY, case_id TEXT NOT NULL REFERENCES cases(id), path_id TEXT NOT NULL REFERENCES paths(id),"
     " created TEXT NOT NULL, cycles INTEGER NOT NULL, complete INTEGER NOT NULL, metrics TEXT NOT NULL,"
     " bytes TEXT NOT NULL)",
     "CREATE INDEX paths_of_case ON paths(case_id)", "CREATE INDEX recordings_of_case ON recordings(case_id)", nullptr},
    // drilled: somebody began to drill it, so it stays as it is; retired: no longer in the plan, kept for its
    // recordings
    {"ALTER TABLE paths ADD COLUMN drilled INTEGER NOT NULL DEFAULT 0",
     "ALTER TABLE paths ADD COLUMN retired INTEGER NOT NULL DEFAULT 0",
     "ALTER TABLE paths ADD COLUMN replaced_by TEXT NOT NULL DEFAULT ''",
     "UPDATE paths SET drilled = 1 WHERE id IN (SELECT path_id FROM recordings)", nullptr},
}};

}  // namespace spinaltap::store
