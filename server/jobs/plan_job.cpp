#include "server/jobs/plan_job.h"

#include <nlohmann/json.hpp>

#include "core/point_volume/point_volume.h"
#include "core/volume/sample.h"
#include "core/wire/point_volume_message.h"
#include "server/jobs/case_files.h"
#include "server/jobs/local_bound.h"
#include "server/store/rows.h"

namespace spinaltap::jobs {
namespace {

// Far below the finest spacing of points: only those this near to the surface are summed directly.
constexpr double kFieldTolerance_mm = 1e-4;

Result<point_volume::PointVolume> buildPoints(store::Store& store, const store::Case& row, const plan::Path& path,
                                              const point_volume::Lattice& lattice) {
  const auto model = loadModel(store, row);
  if (!model) return tl::unexpected(model.error());
  const auto roi = loadRoi(store, row);
  if (!roi) return tl::unexpected(roi.error());
  const Frame frame = plan::pathFrame(path);
  const double first_z_mm = lattice.discZ_mm(0), last_z_mm = lattice.discZ_mm(lattice.discs - 1);
  // a little wider than the points, so that rounding puts none outside
  const Cylinder around{frame, lattice.rings * lattice.spacing_mm, first_z_mm - lattice.spacing_mm,
                        last_z_mm + lattice.spacing_mm};
  Field field = rbf::asField(*model, lipschitzIn(*model, around), kFieldTolerance_mm);
  field.error_mm = kFieldTolerance_mm, field.exact = rbf::asField(*model, field.lipschitz).values;
  const auto hu = [&roi](std::span<const Vec3> points, std::span<double> out) {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = volume::sampleHu(*roi, points[i]);
  };
  return point_volume::buildVolume(lattice, frame, field, hu);
}

}  // namespace

Result<store::Path> planPath(store::Store& store, const PlanJob& job, const Progress& progress) {
  if (const auto checked = checkLabelText(job.label); !checked) return tl::unexpected(checked.error());
  if (const auto checked = plan::checkPath(job.path); !checked) return tl::unexpected(checked.error());
  const auto row = store.findCase(job.case_id);
  if (!row) return tl::unexpected(row.error());
  if (!job.path_id.empty()) {
    if (const auto old = store.findPath(job.case_id, job.path_id); !old) return old;
  }
  const point_volume::Lattice lattice = point_volume::latticeOf(job.path);
  if (lattice.points() > kMostPoints) {
    return fail(ErrorCode::Limit, "path: " + std::to_string(lattice.points()) + " points, over the limit of " +
                                      std::to_string(kMostPoints) + ": choose a larger spacing");
  }
  if (progress) progress("points", 0);
  const auto points = buildPoints(store, *row, job.path, lattice);
  if (!points) return tl::unexpected(points.error());
  const std::uint64_t alive = point_volume::countAlive(*points);
  if (alive == 0) return fail(ErrorCode::Degenerate, "path: there is no bone along it");
  if (progress) progress("keep", 0.9);
  const std::vector<std::byte> bytes = wire::encodePointVolume(*points);
  const auto blob = store.blobs().put(bytes, store::Gzip::Sibling);
  if (!blob) return tl::unexpected(blob.error());
  store::Path wanted{job.path_id, row->id, job.label, "", job.path, lattice, alive, *blob};
  auto kept = job.path_id.empty() ? store.addPath(std::move(wanted)) : store.replacePath(std::move(wanted));
  if (!kept) return kept;
  // Points that were there already may have been dropped with the last path that named them, before this one did.
  if (const auto again = store.blobs().put(bytes, store::Gzip::Sibling); !again) return tl::unexpected(again.error());
  return kept;
}

Figures describe(const store::Path& row) {
  using store::toJson;
  const Frame frame = plan::pathFrame(row.path);
  return {{"id", row.id},
          {"case_id", row.case_id},
          {"label", row.label},
          {"created", row.created},
          {"entry_patient", toJson(row.path.entry_patient)},
          {"target_patient", toJson(row.path.target_patient)},
          {"bit", toJson(row.path.bit)},
          {"volume_radius_mm", row.path.volume_radius_mm},
          {"lead_mm", row.path.lead_mm},
          {"spacing_mm", row.path.spacing_mm},
          {"length_mm", plan::length(row.path)},
          {"frame",
           {{"origin_patient", toJson(frame.origin_patient)},
            {"axes", {toJson(frame.axes.col_x), toJson(frame.axes.col_y), toJson(frame.axes.col_z)}}}},
          {"lattice", toJson(row.lattice)},
          {"points", row.lattice.points()},
          {"points_alive", row.points_alive},
          {"retired", row.retired},
          {"replaced_by", row.replaced_by}};
}

}  // namespace spinaltap::jobs
