#include "server/jobs/segment_job.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/volume/crop.h"
#include "server/jobs/case_files.h"

namespace spinaltap::jobs {
namespace {

constexpr double kLoaded = 0.1;  // of the work, when the CT has been read

Figures triple(const Vec3& v) { return {v.x, v.y, v.z}; }

/// What isolating found beside the label.
Figures figuresOf(const segment::Isolated& found) {
  auto neighbours = Figures::array();
  for (const auto& n : found.neighbours) {
    neighbours.push_back(
        {{"side", n.above ? "above" : "below"}, {"body_middle_patient", triple(n.body_middle_patient)}});
  }
  return {{"threshold_hu", found.threshold_hu},
          {"body_middle_patient", triple(found.body_middle_patient)},
          {"body_height_mm", found.body_height_mm},
          {"neighbours", std::move(neighbours)}};
}

struct Made {
  volume::LabelVolume label;
  Figures also = Figures::object();
};

Result<Made> makeLabel(store::Store& store, const store::Case& row, const SegmentJob& job, const Progress& progress) {
  const auto only = [](volume::LabelVolume label) { return Made{std::move(label)}; };
  if (!job.grow && !job.isolate) {
    if (row.label_blob.empty()) {
      return fail(ErrorCode::InvalidArgument, "case " + row.id + " was imported without a label: give a seed");
    }
    const auto imported = loadLabel(store, row);
    if (!imported) return tl::unexpected(imported.error());
    return segment::largestIsland(*imported).map(only);
  }
  const auto ct = loadCt(store, row);
  if (!ct) return tl::unexpected(ct.error());
  if (job.grow) return segment::growFromSeed(*ct, *job.grow).map(only);
  auto found = segment::isolate(*ct, *job.isolate, [&](std::string_view stage, double done) {
    if (progress) progress(stage, kLoaded + (1 - kLoaded) * done);
  });
  if (!found) return tl::unexpected(found.error());
  Figures also = figuresOf(*found);
  return Made{std::move(found->label), std::move(also)};
}

}  // namespace

Result<Figures> segmentCase(store::Store& store, const SegmentJob& job, const Progress& progress) {
  Stopwatch watch;
  const auto row = store.findCase(job.case_id);
  if (!row) return tl::unexpected(row.error());
  if (progress) progress("load", 0);
  const auto made = makeLabel(store, *row, job, progress);
  if (!made) return tl::unexpected(made.error());
  const volume::LabelVolume& label = made->label;
  const auto box = volume::boundsOf(label);
  if (!box) return tl::unexpected(box.error());

  const bool kept = !job.grow && !job.isolate;
  const std::string source = kept ? row->label_source : "segmented";
  const auto blob = store.blobs().put(encodeLabel(label));
  if (!blob) return tl::unexpected(blob.error());
  if (const auto set = store.setLabel(row->id, *blob, source); !set) return tl::unexpected(set.error());

  const auto voxels = std::count_if(label.inside.begin(), label.inside.end(), [](std::uint8_t v) { return v != 0; });
  const Vec3& s = label.grid.spacing_mm;
  const auto edge = [&](std::size_t a, double spacing) { return (box->high[a] - box->low[a] + 1) * spacing; };
  Figures figures{{"case_id", row->id},
                  {"source", source},
                  {"actions", kept ? 0 : 1},
                  {"voxels", voxels},
                  {"volume_mm3", static_cast<double>(voxels) * s.x * s.y * s.z},
                  {"box_mm", {edge(0, s.x), edge(1, s.y), edge(2, s.z)}}};
  figures.update(made->also);
  figures["total_s"] = watch.lap_s();
  return figures;
}

}  // namespace spinaltap::jobs
