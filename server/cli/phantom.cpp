
#include "server/cli/commands.h"
#include "server/dicom_out/phantom_series.h"
#include "server/store/rows.h"

namespace spinaltap::cli {
namespace {

jobs::Figures pedicle(const phantom::PediclePath& path) {
  return {{"entry_patient", store::toJson(path.entry_patient)},
          {"target_patient", store::toJson(path.target_patient)},
          {"width_mm", path.width_mm},
          {"height_mm", path.height_mm}};
}

}  // namespace

Result<Outcome> runPhantom(const PhantomOptions& options, ProgressBar& bar) {
  jobs::Stopwatch watch;
  dicom_out::PhantomSeriesOptions series;
  series.phantom.seed = options.seed;
  series.phantom.osteoporotic = options.osteoporotic;
  series.ct = phantom::CtOptions::coarser(options.reduce);
  series.ct.seed = options.seed;
  const auto made =
      dicom_out::writePhantomSeries(options.out, series, [&](double fraction) { bar.show("phantom", fraction); });
  if (!made) return tl::unexpected(made.error());
  return Outcome{{{"slices", made->slices},
                  {"dims", made->grid.dims},
                  {"spacing_mm", store::toJson(made->grid.spacing_mm)},
                  {"bone_mm3", made->bone_mm3},
                  {"seed_point_patient", store::toJson(made->seed_point_patient)},
                  {"pedicles", {{"left", pedicle(made->left)}, {"right", pedicle(made->right)}}},
                  {"total_s", watch.lap_s()}}};
}

}  // namespace spinaltap::cli
