#include "server/jobs/import_job.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "server/jobs/case_files.h"
#include "server/store/rows.h"

namespace spinaltap::jobs {

Result<Figures> importCase(store::Store& store, const ImportJob& job, const Progress& progress) {
  if (const auto checked = checkLabelText(job.label); !checked) return tl::unexpected(checked.error());
  Stopwatch watch;
  const auto report = [&](const importer::ImportProgress& p) {
    if (progress) progress(p.stage, p.total == 0 ? 0 : static_cast<double>(p.done) / static_cast<double>(p.total));
  };
  const auto imported = importer::importVolume(job.request, report);
  if (!imported) return tl::unexpected(imported.error());

  if (progress) progress("keep", 0);
  store::Case row;
  row.label = job.label.empty() ? "CT" : job.label;
  row.grid = imported->ct.grid;
  const auto ct = store.blobs().put(encodeCt(imported->ct));
  if (!ct) return tl::unexpected(ct.error());
  row.ct = *ct;
  const std::optional<volume::LabelVolume>& label = imported->label;
  if (label) {
    const auto blob = store.blobs().put(encodeLabel(*label));
    if (!blob) return tl::unexpected(blob.error());
    row.label_blob = *blob;
    row.label_source = "imported";
  }
  const auto kept = store.addCase(row);
  if (!kept) return tl::unexpected(kept.error());

  const auto [low, high] = std::minmax_element(imported->ct.hu.begin(), imported->ct.hu.end());
  Figures figures{{"case_id", kept->id},
                  {"label", kept->label},
                  {"source", importer::nameOf(imported->source)},
                  {"dims", row.grid.dims},
                  {"spacing_mm", store::toJson(row.grid.spacing_mm)},
                  {"voxels", row.grid.voxels()},
                  {"hu_min", *low},
                  {"hu_max", *high}};
  if (label) {
    const auto& inside = label->inside;
    figures["label_voxels"] = std::count_if(inside.begin(), inside.end(), [](std::uint8_t v) { return v != 0; });
  }
  figures["notes"] = imported->notes;
  figures["total_s"] = watch.lap_s();
  return figures;
}

}  // namespace spinaltap::jobs
