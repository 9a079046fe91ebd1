// core/tradeoff/surface_tradeoff.h - what a surface costs and how true it is, setting by setting.
// The methods compared are those of R. Schmidt, "SpinalTap" (2002), sections 3.3 and 3.4, and ours (surface/methods.h).
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/mesh/triangle_mesh.h"
#include "core/phantom/ct.h"
#include "core/rbf/rbf.h"
#include "core/surface/methods.h"
#include "core/tradeoff/measure.h"

namespace spinaltap::tradeoff {

/// A vertebra to be reconstructed, and what is known of it.
struct Scene {
  volume::CtVolume ct;
  volume::LabelVolume label;
  std::optional<phantom::Phantom> truth;  ///< exact; without it, the CT's own edge at points kept from the fit
  double true_mm3 = 0;                    ///< of the truth, else of the label
};

/// The phantom's CT, segmented from a seed as a user without a label would. @error as sampleCt and growFromSeed.
[[nodiscard]] Result<Scene> phantomScene(const phantom::PhantomOptions& options, const phantom::CtOptions& ct,
                                         const std::function<void(double)>& progress = {});
/// @error NotFound (empty label).
[[nodiscard]] Result<Scene> caseScene(volume::CtVolume ct, volume::LabelVolume label);

struct Setting {
  surface::Method method = surface::Method::Subvoxel;
  double tolerance_mm = 0.01;
  double smoothing = 0;  ///< mm, or rbf::kAutoSmoothing
  double reduce_mm = 0;
};

/// So much that pixels swell the bone by millimetres, as the report saw with 30: its fitter scales smoothing by what it
/// does not state.
inline constexpr double kSwellingSmoothing_mm = 300;

/// What the program's tables show: each method with smoothing 0, 0.5 and 30, as in the report, and with heavy
/// smoothing; then for ours the smoothing chosen from the noise, tolerances, and reductions.
[[nodiscard]] std::vector<Setting> usualSettings();

struct Measured {
  Setting setting;
  std::string fault;  ///< why there is no surface; then what follows is 0
  std::size_t samples = 0, centres = 0;
  double smoothing = 0, noise_mm = 0;  ///< as used, as estimated
  double residual_rms_mm = 0, residual_max_mm = 0;
  double sample_s = 0, fit_s = 0, mesh_s = 0;
  double points_per_s = 0;  ///< values of the field to 1e-4 mm, near the bone
  Distances surface;        ///< truth known: of the mesh from it; else of the points kept from the fit from the surface
  Distances missed;         ///< truth known: of points of it from the surface
  Sides sides;              ///< truth known: points farther than kSideMargin_mm from it
  double volume_mm3 = 0, volume_change_percent = 0;  ///< of Scene::true_mm3
  double roughness_mm = 0;
  std::size_t triangles = 0;
};

/// "inside or outside must be right for points farther than this from the surface": a pixel of the report's scanner.
inline constexpr double kSideMargin_mm = 0.35;

/// core has no clock: the caller's, in seconds.
using Clock = std::function<double()>;

struct RunOptions {
  double sample_spacing_mm = surface::kSampleSpacing_mm;
  double cell_mm = surface::kCell_mm;
  Clock clock;  ///< without one, seconds are 0
  std::uint64_t seed = 2002;
  std::size_t points = 20'000;                             ///< distances are measured at; sides at ten times as many
  std::size_t timed_points = 300'000;                      ///< 0: the rate is not asked for
  double field_tolerance_mm = surface::kMeshTolerance_mm;  ///< of the fast sums for mesh and measures; 0: direct
};

struct Run {
  Measured measured;
  Field field;  ///< empty when there was a fault
  mesh::TriangleMesh mesh;
};

/// Samples, fits, polygonises and measures. A fit or mesh that fails is a row with a fault, not an error.
/// @error of sampling: the scene itself is of no use.
[[nodiscard]] Result<Run> runSetting(const Scene& scene, const Setting& setting, const RunOptions& options,
                                     const std::function<void(double)>& progress = {});

}  // namespace spinaltap::tradeoff
