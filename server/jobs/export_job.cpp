#include "server/jobs/export_job.h"

#include <nlohmann/json.hpp>

#include "server/jobs/case_files.h"
#include "server/mesh_out/simplify.h"

namespace spinaltap::jobs {

Result<std::vector<std::byte>> meshFile(store::Store& store, const store::Case& row, mesh_out::Format format) {
  const auto mesh = loadMesh(store, row);
  if (!mesh) return tl::unexpected(mesh.error());
  return mesh_out::encode(*mesh, format);
}

Result<Figures> exportMesh(store::Store& store, const ExportJob& job, const Progress& progress) {
  Stopwatch total;
  const auto row = store.findCase(job.case_id);
  if (!row) return tl::unexpected(row.error());
  auto mesh = loadMesh(store, *row);
  if (!mesh) return tl::unexpected(mesh.error());
  const std::size_t before = mesh->triangles.size();
  if (job.simplify_mm) {
    if (progress) progress("simplify", 0);
    mesh = mesh_out::simplify(*mesh, *job.simplify_mm);
    if (!mesh) return tl::unexpected(mesh.error());
  }
  if (progress) progress("write", 0.9);
  const auto bytes = mesh_out::encode(*mesh, job.format);
  if (!bytes) return tl::unexpected(bytes.error());
  if (const auto written = store::replaceFile(job.out, *bytes); !written) return tl::unexpected(written.error());

  Figures figures{{"case_id", row->id},
                  {"format", mesh_out::nameOf(job.format)},
                  {"vertices", mesh->vertices.size()},
                  {"triangles", mesh->triangles.size()},
                  {"bytes", bytes->size()}};
  if (job.simplify_mm) figures["triangles_before"] = before, figures["simplify_mm"] = *job.simplify_mm;
  figures["total_s"] = total.lap_s();
  return figures;
}

}  // namespace spinaltap::jobs
