// Which windows on a vertebra the outlines are shown in, and what is seen there.
#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/box.h"
#include "core/mesh/polygonise.h"
#include "core/surface/defaults.h"
#include "core/volume/sample.h"
#include "server/jobs/tradeoff_plots.h"
#include "server/plots/png.h"

namespace spinaltap::jobs {
namespace {

constexpr double kMargin_mm = 6, kDetail_mm = 16;
constexpr double kPixel_mm = 0.25, kDetailPixel_mm = 0.1;
constexpr std::size_t kTruthSeeds = 200;
constexpr double kBlack_hu = -250, kWhite_hu = 1250;

struct Extent {
  Box box;
  Vec3 middle;
  double fullest_z = 0;  ///< where most of the label lies in one axial slice: at the pedicles
  std::vector<Vec3> places;
};

Extent extentOf(const volume::LabelVolume& label) {
  Extent out;
  const auto& d = label.grid.dims;
  for (int k = 0; k < d[2]; ++k)
    for (int j = 0; j < d[1]; ++j)
      for (int i = 0; i < d[0]; ++i)
        if (label.inside[label.grid.index(i, j, k)] != 0) {
          out.places.push_back(label.grid.toPatient({1.0 * i, 1.0 * j, 1.0 * k}));
        }
  out.box = boxAround(out.places);
  std::map<long, std::size_t> by_slice;
  const Vec3& s = label.grid.spacing_mm;
  const double slice = std::max({1.0, s.x, s.y, s.z});
  for (const Vec3& p : out.places) {
    out.middle += p / static_cast<double>(out.places.size());
    ++by_slice[std::lround(p.z / slice)];
  }
  const auto fullest = std::max_element(by_slice.begin(), by_slice.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  out.fullest_z = static_cast<double>(fullest->first) * slice;
  return out;
}

/// Rows of pixels of the window, grey by HU.
std::string pictureOf(const volume::CtVolume& ct, const tradeoff::Plane& plane, double pixel_mm) {
  const auto width = static_cast<std::uint32_t>(plane.width_mm / pixel_mm);
  const auto height = static_cast<std::uint32_t>(plane.height_mm / pixel_mm);
  std::vector<std::uint8_t> grey;
  grey.reserve(static_cast<std::size_t>(width) * height);
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const Vec3 p = plane.origin_patient + plane.right * ((x + 0.5) * pixel_mm) + plane.down * ((y + 0.5) * pixel_mm);
      const double part = (volume::sampleHu(ct, p) - kBlack_hu) / (kWhite_hu - kBlack_hu);
      grey.push_back(static_cast<std::uint8_t>(255 * std::clamp(part, 0.0, 1.0)));
    }
  }
  return plots::pngAddress(grey, width, height);
}

/// The label's place farthest to the back and the side near the axial plane: an articular or transverse process.
Vec3 corner(const Extent& e) {
  Vec3 best = e.middle;
  double farthest = -1e300;
  for (const Vec3& p : e.places) {
    if (std::abs(p.z - e.fullest_z) > 2) continue;
    const double reach = std::abs(p.x - e.middle.x) + 0.8 * (p.y - e.middle.y);
    if (p.x > e.middle.x && reach > farthest) farthest = reach, best = p;
  }
  return best;
}

/// The truth as a mesh; empty when it is not known.
mesh::TriangleMesh meshOfTruth(const tradeoff::Scene& scene) {
  if (!scene.truth) return {};
  const auto bounds = scene.truth->bounds();
  auto made = mesh::polygonise(scene.truth->field(), tradeoff::pointsOfTruth(*scene.truth, kTruthSeeds, 1),
                               {surface::kCell_mm, bounds.low_patient, bounds.high_patient});
  return made ? std::move(*made) : mesh::TriangleMesh{};
}

/// From above, from the patient's left and from the front.
std::vector<View> alongAxes(const tradeoff::Scene& scene, const Extent& e) {
  const auto [low, high] = e.box.widened(kMargin_mm);
  const Vec3 size = high - low;
  const mesh::TriangleMesh truth = meshOfTruth(scene);
  const auto view = [&](std::string name, const tradeoff::Plane& plane) {
    View v;
    v.name = std::move(name), v.along_axis = true, v.plane = plane;
    v.truth = tradeoff::silhouetteOf(truth, plane, v.step_mm);
    return v;
  };
  const Vec3 down_z{0, 0, -1};
  return {view("from above", {low, {1, 0, 0}, {0, 1, 0}, size.x, size.y}),
          view("from the side", {{0, low.y, high.z}, {0, 1, 0}, down_z, size.y, size.z}),
          view("from the front", {{low.x, 0, high.z}, {1, 0, 0}, down_z, size.x, size.z})};
}

}  // namespace

std::vector<View> viewsOf(const tradeoff::Scene& scene) {
  const Extent e = extentOf(scene.label);
  const auto [low, high] = e.box.widened(kMargin_mm);
  const Vec3 size = high - low;
  const auto view = [&](std::string name, const tradeoff::Plane& plane, double step_mm, double bar_mm,
                        double pixel_mm) {
    View v;
    v.name = std::move(name), v.plane = plane, v.step_mm = step_mm, v.scale_bar_mm = bar_mm;
    v.picture = pictureOf(scene.ct, plane, pixel_mm);
    if (scene.truth) v.truth = tradeoff::contourOf(scene.truth->field(), plane, step_mm);
    return v;
  };
  std::vector<View> out = alongAxes(scene, e);
  const Vec3 down_z{0, 0, -1};
  const Vec3 process = corner(e);
  const Vec3 detail{process.x - 0.65 * kDetail_mm, process.y - 0.55 * kDetail_mm, e.fullest_z};
  out.push_back(view("across, at the pedicles", {{low.x, low.y, e.fullest_z}, {1, 0, 0}, {0, 1, 0}, size.x, size.y},
                     0.25, 10, kPixel_mm));
  out.push_back(view("along, in the middle", {{e.middle.x, low.y, high.z}, {0, 1, 0}, down_z, size.y, size.z}, 0.25, 10,
                     kPixel_mm));
  out.push_back(
      view("close, at a process", {detail, {1, 0, 0}, {0, 1, 0}, kDetail_mm, kDetail_mm}, 0.1, 2, kDetailPixel_mm));
  return out;
}

void addOutlines(const tradeoff::Run& run, std::vector<View>& views) {
  const auto& setting = run.measured.setting;
  const auto at = std::find(kReportSmoothings.begin(), kReportSmoothings.end(), setting.smoothing);
  if (at == kReportSmoothings.end() || setting.reduce_mm != 0 || !run.field.values) return;
  const auto which = static_cast<std::size_t>(at - kReportSmoothings.begin());
  for (View& view : views) {
    view.methods[static_cast<std::size_t>(setting.method)][which] =
        view.along_axis ? tradeoff::silhouetteOf(run.mesh, view.plane, view.step_mm)
                        : tradeoff::contourOf(run.field, view.plane, view.step_mm);
  }
}

}  // namespace spinaltap::jobs
