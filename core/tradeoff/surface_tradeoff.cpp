#include "core/tradeoff/surface_tradeoff.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/box.h"
#include "core/base/random.h"
#include "core/mesh/parts.h"
#include "core/mesh/polygonise.h"
#include "core/segment/segment.h"
#include "core/surface/defaults.h"
#include "core/volume/crop.h"

namespace spinaltap::tradeoff {
namespace {

using surface::Method;

constexpr std::size_t kHeldOut = 5;     // every fifth
constexpr double kFarthest_mm = 20;     // a foot that is farther counts with this
constexpr std::size_t kSeedStride = 8;  // of the points, for the mesh to start from
constexpr double kTimedBand_mm = 2;     // timed points lie so near the bone, as those of a point volume do
constexpr double kEvaluate_mm = 1e-4;   // to which values are asked for

/// The share of the whole that each stage takes, about.
class Shares {
 public:
  explicit Shares(const std::function<void(double)>& progress) : progress_(progress) {}
  [[nodiscard]] std::function<void(double)> stage(double from, double to) const {
    if (!progress_) return {};
    return [progress = progress_, from, to](double part) { progress(from + (to - from) * part); };
  }

 private:
  const std::function<void(double)>& progress_;
};

struct Held {
  surface::OrientedPoints fitted;
  std::vector<Vec3> kept;  ///< every fifth of those that the CT placed
};

Held holdOut(const surface::OrientedPoints& all) {
  Held out;
  out.fitted.scanner = all.scanner;
  for (std::size_t i = 0; i < all.normals.size(); ++i) {
    if (i % kHeldOut == kHeldOut - 1 && all.placed[i] == surface::Placed::ByCt) {
      out.kept.push_back(all.positions_patient[i]);
      continue;
    }
    out.fitted.positions_patient.push_back(all.positions_patient[i]);
    out.fitted.normals.push_back(all.normals[i]);
    out.fitted.placed.push_back(all.placed[i]);
    out.fitted.from_ct += all.placed[i] == surface::Placed::ByCt ? 1 : 0;
  }
  return out;
}

struct Sampling {
  surface::SampledSurface made;
  std::vector<Vec3> kept;
  double seconds = 0;
};

/// With the truth known every point is fitted; else every fifth of the CT's is kept, from any method's fit alike.
Result<Sampling> sample(const Scene& scene, Method method, const RunOptions& options, const Clock& clock) {
  surface::BoundaryOptions boundary;
  boundary.spacing_mm = options.sample_spacing_mm;
  Sampling out;
  const double start = clock();
  auto made = surface::sampleSurface(scene.ct, scene.label, method, boundary);
  if (!made) return tl::unexpected(made.error());
  out.seconds = clock() - start;
  out.made = std::move(*made);
  if (scene.truth) return out;
  if (method != Method::Subvoxel) {
    const auto edge = surface::findBoundary(scene.ct, scene.label, boundary);
    if (!edge) return tl::unexpected(edge.error());
    out.kept = holdOut(*edge).kept;
    return out;
  }
  Held held = holdOut(out.made.points);
  auto samples = surface::makeSamples(held.fitted);
  if (!samples) return tl::unexpected(samples.error());
  out.made = {std::move(held.fitted), std::move(*samples)};
  out.kept = std::move(held.kept);
  return out;
}

/// A swollen surface does not pass by its samples: some are moved onto it, for the mesh to start from.
std::vector<Vec3> seedsOf(const Field& field, const std::vector<Vec3>& points) {
  std::vector<Vec3> feet;
  for (std::size_t i = 0; i < points.size(); i += kSeedStride) feet.push_back(points[i]);
  std::vector<Vec3> gradients(feet.size());
  std::vector<double> values(feet.size());
  for (int step = 0; step < 4; ++step) {
    field.values(feet, values);
    field.gradients(feet, gradients);
    for (std::size_t i = 0; i < feet.size(); ++i) {
      const double square = dot(gradients[i], gradients[i]);
      const Vec3 move = square > 1e-6 ? gradients[i] * (-values[i] / square) : Vec3{};
      feet[i] += norm(move) > 2 ? move * (2 / norm(move)) : move;
    }
  }
  return feet;
}

double evaluationRate(const Field& field, const std::vector<Vec3>& near, const RunOptions& options,
                      const Clock& clock) {
  Random random(options.seed);
  std::vector<Vec3> points;
  points.reserve(options.timed_points);
  const auto shift = [&] { return random.uniform(-kTimedBand_mm, kTimedBand_mm); };
  for (std::size_t n = 0; n < options.timed_points; ++n) {
    points.push_back(near[random.below(near.size())] + Vec3{shift(), shift(), shift()});
  }
  std::vector<double> out(points.size());
  const double start = clock();
  field.values(points, out);
  const double seconds = clock() - start;
  return seconds > 0 ? static_cast<double>(options.timed_points) / seconds : 0;
}

void measureRun(const Scene& scene, const RunOptions& options, const Sampling& sampling, Run& run) {
  Measured& m = run.measured;
  m.volume_mm3 = volumeOf(run.mesh);
  m.volume_change_percent = 100 * (m.volume_mm3 / scene.true_mm3 - 1);
  m.roughness_mm = roughnessOf(run.mesh);
  m.triangles = run.mesh.triangles.size();
  if (!scene.truth) {
    m.surface = toSurface(run.field, sampling.kept, kFarthest_mm);
    return;
  }
  m.surface = fromTruth(run.mesh, *scene.truth, options.points, options.seed);
  m.missed = toSurface(run.field, pointsOfTruth(*scene.truth, options.points, options.seed + 1), kFarthest_mm);
  m.sides = sidesOf(run.field, *scene.truth, kSideMargin_mm, 10 * options.points, options.seed + 2);
}

void takeReport(const rbf::FitReport& report, Measured& m) {
  m.samples = report.samples, m.centres = report.centres;
  m.smoothing = report.smoothing, m.noise_mm = report.noise_mm;
  m.residual_rms_mm = report.residual_rms_mm, m.residual_max_mm = report.residual_max_mm;
}

}  // namespace

Result<Scene> phantomScene(const phantom::PhantomOptions& options, const phantom::CtOptions& ct_options,
                           const std::function<void(double)>& progress) {
  const auto truth = phantom::Phantom::make(options);
  auto ct = phantom::sampleCt(truth, ct_options, progress);
  if (!ct) return tl::unexpected(ct.error());
  segment::GrowOptions grow;
  grow.seed_patient = truth.seedPoint();
  auto label = segment::growFromSeed(*ct, grow);
  if (!label) return tl::unexpected(label.error());
  return Scene{std::move(*ct), std::move(*label), truth, volumeOf(truth)};
}

Result<Scene> caseScene(volume::CtVolume ct, volume::LabelVolume label) {
  const auto box = volume::boundsOf(label);
  if (!box) return tl::unexpected(box.error());
  const Vec3& s = label.grid.spacing_mm;
  const auto inside = std::count(label.inside.begin(), label.inside.end(), 1);
  return Scene{std::move(ct), std::move(label), std::nullopt, static_cast<double>(inside) * s.x * s.y * s.z};
}

std::vector<Setting> usualSettings() {
  std::vector<Setting> out;
  for (const Method method : {Method::Pixel, Method::Normal, Method::Subvoxel}) {
    for (const double smoothing : {0.0, 0.5, 30.0, kSwellingSmoothing_mm}) out.push_back({method, 0.01, smoothing, 0});
  }
  for (const double tolerance : {0.1, 0.01, 0.001}) {
    out.push_back({Method::Subvoxel, tolerance, rbf::kAutoSmoothing, 0});
  }
  for (const double reduce : {0.02, 0.05, 0.1, 0.2}) {
    out.push_back({Method::Subvoxel, 0.01, rbf::kAutoSmoothing, reduce});
  }
  return out;
}

Result<Run> runSetting(const Scene& scene, const Setting& setting, const RunOptions& options,
                       const std::function<void(double)>& progress) {
  const Shares shares(progress);
  const Clock clock = options.clock ? options.clock : Clock([] { return 0.0; });
  Run run;
  run.measured.setting = setting;
  const auto sampling = sample(scene, setting.method, options, clock);
  if (!sampling) return tl::unexpected(sampling.error());
  run.measured.sample_s = sampling->seconds;
  const auto& points = sampling->made.points.positions_patient;

  double start = clock();
  auto fit = rbf::fit({sampling->made.samples.positions, sampling->made.samples.distances_mm},
                      {setting.tolerance_mm, setting.smoothing, setting.reduce_mm, 0}, shares.stage(0.1, 0.5));
  run.measured.fit_s = clock() - start;
  if (!fit) {
    run.measured.fault = fit.error().message;
    return run;
  }
  takeReport(fit->report, run.measured);
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  if (options.timed_points > 0) {
    const Field exact = rbf::asField(fit->model, kUnknown, kEvaluate_mm);
    run.measured.points_per_s = evaluationRate(exact, points, options, clock);
  }
  const Field field = rbf::asField(fit->model, kUnknown, options.field_tolerance_mm);

  start = clock();
  const Box box = boxAround(points).widened(surface::meshMarginFor(setting.method, setting.smoothing));
  auto mesh =
      mesh::polygonise(field, seedsOf(field, points), {options.cell_mm, box.low, box.high}, shares.stage(0.6, 0.7));
  if (!mesh) {
    run.measured.fault = mesh.error().message;
    return run;
  }
  run.mesh = mesh::largestPart(*mesh);
  run.measured.mesh_s = clock() - start;
  run.field = field;
  measureRun(scene, options, *sampling, run);
  return run;
}

}  // namespace spinaltap::tradeoff
