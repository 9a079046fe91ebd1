#include "server/jobs/segment_job.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/volume/crop.h"
#include "server/jobs/case_files.h"

namespace spinaltap::jobs {
namespace {

Result<volume::LabelVolume> makeLabel(store::Store& store, const store::Case& row, const SegmentJob& job) {
  if (!job.grow) {
    auto imported = loadLabel(store, row);
    if (!imported) return imported;
    return segment::largestIsland(*imported);
  }
  const auto ct = loadCt(store, row);
  if (!ct) return tl::unexpected(ct.error());
  return segment::growFromSeed(*ct, *job.grow);
}

}  // namespace

Result<Figures> segmentCase(store::Store& store, const SegmentJob& job, const Progress& progress) {
  Stopwatch watch;
  const auto row = store.findCase(job.case_id);
  if (!row) return tl::unexpected(row.error());
  if (!job.grow && row->label_blob.empty()) {
    return fail(ErrorCode::InvalidArgument, "case " + row->id + " was imported without a label: give a seed");
  }
  if (progress) progress("segment", 0);
  const auto label = makeLabel(store, *row, job);
  if (!label) return tl::unexpected(label.error());
  const auto box = volume::boundsOf(*label);
  if (!box) return tl::unexpected(box.error());

  const std::string source = job.grow ? "segmented" : row->label_source;
  const auto blob = store.blobs().put(encodeLabel(*label));
  if (!blob) return tl::unexpected(blob.error());
  if (const auto kept = store.setLabel(row->id, *blob, source); !kept) return tl::unexpected(kept.error());

  const auto voxels = std::count_if(label->inside.begin(), label->inside.end(), [](std::uint8_t v) { return v != 0; });
  const Vec3& s = label->grid.spacing_mm;
  const auto edge = [&](std::size_t a, double spacing) { return (box->high[a] - box->low[a] + 1) * spacing; };
  return Figures{{"case_id", row->id},
                 {"source", source},
                 {"voxels", voxels},
                 {"volume_mm3", static_cast<double>(voxels) * s.x * s.y * s.z},
                 {"box_mm", {edge(0, s.x), edge(1, s.y), edge(2, s.z)}},
                 {"total_s", watch.lap_s()}};
}

}  // namespace spinaltap::jobs
