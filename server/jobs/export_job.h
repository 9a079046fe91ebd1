// server/jobs/export_job.h - a case's surface as a file for other programs.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "server/jobs/figures.h"
#include "server/mesh_out/mesh_file.h"
#include "server/store/store.h"

namespace spinaltap::jobs {

struct ExportJob {
  std::string case_id;
  mesh_out::Format format = mesh_out::Format::Stl;
  std::optional<double> simplify_mm;  ///< see mesh_out/simplify.h; default: every triangle
  std::filesystem::path out;          ///< replaced whole or not at all
};

/// Figures: case_id, format, vertices, triangles, bytes, total_s; simplified also triangles_before and simplify_mm.
/// @error NotFound (no such case, not reconstructed), Io, and those of mesh_out.
[[nodiscard]] Result<Figures> exportMesh(store::Store& store, const ExportJob& job, const Progress& progress);

/// The file's bytes, every triangle. @error as exportMesh.
[[nodiscard]] Result<std::vector<std::byte>> meshFile(store::Store& store, const store::Case& row,
                                                      mesh_out::Format format);

}  // namespace spinaltap::jobs
