#include "server/jobs/reconstruct_job.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/base/box.h"
#include "core/mesh/parts.h"
#include "core/mesh/polygonise.h"
#include "core/surface/methods.h"
#include "core/wire/mesh_message.h"
#include "server/jobs/case_files.h"

namespace spinaltap::jobs {
namespace {

mesh::PolygoniseOptions meshOptions(const std::vector<Vec3>& points, double cell_mm, double margin_mm) {
  const Box box = boxAround(points).widened(margin_mm);
  return {cell_mm, box.low, box.high};
}

Result<void> keep(store::Store& store, const std::string& case_id, const volume::CtVolume& roi, const rbf::Model& model,
                  const mesh::TriangleMesh& mesh, const Figures& figures) {
  store::Reconstruction made;
  const auto roi_blob = store.blobs().put(encodeCt(roi), store::Gzip::Sibling);
  if (!roi_blob) return tl::unexpected(roi_blob.error());
  const auto model_blob = store.blobs().put(encodeModel(model));
  if (!model_blob) return tl::unexpected(model_blob.error());
  const auto mesh_blob = store.blobs().put(wire::encodeMesh(mesh), store::Gzip::Sibling);
  if (!mesh_blob) return tl::unexpected(mesh_blob.error());
  return store.setReconstruction(case_id, {*roi_blob, *model_blob, *mesh_blob, figures.dump()});
}

std::function<void(double)> stage(const Progress& progress, const char* name) {
  if (!progress) return {};
  return [&progress, name](double fraction) { progress(name, fraction); };
}

Result<surface::SampledSurface> sampleRegion(const Region& region, const ReconstructJob& job, double spacing_mm,
                                             const Progress& progress) {
  surface::BoundaryOptions options;
  options.spacing_mm = spacing_mm;
  return surface::sampleSurface(region.ct, region.label, job.method, options, stage(progress, "boundary"));
}

}  // namespace

Result<Figures> reconstructCase(store::Store& store, const ReconstructJob& job, const Progress& progress) {
  Stopwatch total, watch;
  const auto row = store.findCase(job.case_id);
  if (!row) return tl::unexpected(row.error());
  if (progress) progress("load", 0);
  const auto region = loadRegion(store, *row);
  if (!region) return tl::unexpected(region.error());
  const double load_s = watch.lap_s();

  const double spacing_mm = job.sample_spacing_mm.value_or(surface::sampleSpacingFor(region->ct.grid.spacing_mm));
  auto sampled = sampleRegion(*region, job, spacing_mm, progress);
  if (!sampled) return tl::unexpected(sampled.error());
  const surface::OrientedPoints& points = sampled->points;
  const double boundary_s = watch.lap_s();

  const rbf::Samples samples{std::move(sampled->samples.positions), std::move(sampled->samples.distances_mm)};
  rbf::FitOptions options;
  options.smoothing = job.smoothing_mm.value_or(rbf::kAutoSmoothing);
  options.reduce_mm = job.tolerance_mm;
  const auto fit = rbf::fit(samples, options, stage(progress, "fit"));
  if (!fit) return tl::unexpected(fit.error());
  const double fit_s = watch.lap_s();

  const Field field = rbf::asField(fit->model, lipschitzOf(fit->model), surface::kMeshTolerance_mm);
  const double margin_mm = surface::meshMarginFor(job.method, job.smoothing_mm.value_or(0));
  const auto all_parts =
      mesh::polygonise(field, points.positions_patient, meshOptions(points.positions_patient, job.cell_mm, margin_mm),
                       stage(progress, "mesh"));
  if (!all_parts) return tl::unexpected(all_parts.error());
  const mesh::TriangleMesh mesh = mesh::largestPart(*all_parts);  // coarse scans leave specks
  const double mesh_s = watch.lap_s();

  Figures figures{{"case_id", row->id},
                  {"method", std::string(surface::nameOf(job.method))},
                  {"sample_spacing_mm", spacing_mm},
                  {"boundary_points", points.positions_patient.size()},
                  {"boundary_points_from_ct", points.from_ct},
                  {"blur_mm", {points.scanner.blur_mm.x, points.scanner.blur_mm.y, points.scanner.blur_mm.z}},
                  {"cortical_hu", points.scanner.cortical_hu},
                  {"samples", fit->report.samples},
                  {"centres", fit->report.centres},
                  {"residual_max_mm", fit->report.residual_max_mm},
                  {"residual_rms_mm", fit->report.residual_rms_mm},
                  {"reduction_max_mm", fit->report.reduction_max_mm},
                  {"tolerance_mm", job.tolerance_mm},
                  {"noise_mm", fit->report.noise_mm},
                  {"smoothing_mm", fit->report.smoothing},
                  {"sum_abs_weights", fit->report.sum_abs_weights},
                  {"vertices", mesh.vertices.size()},
                  {"triangles", mesh.triangles.size()},
                  {"roi_dims", region->ct.grid.dims},
                  {"load_s", load_s},
                  {"boundary_s", boundary_s},
                  {"fit_s", fit_s},
                  {"mesh_s", mesh_s}};
  if (progress) progress("keep", 0);
  const auto kept = keep(store, row->id, region->ct, fit->model, mesh, figures);
  if (!kept) return tl::unexpected(kept.error());
  figures["keep_s"] = watch.lap_s();
  figures["total_s"] = total.lap_s();
  return figures;
}

}  // namespace spinaltap::jobs
