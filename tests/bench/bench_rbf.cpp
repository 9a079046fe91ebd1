// The radial basis function stage on samples of the phantom's surface: fits, reduction and evaluation, each beside a
// rival in the same process. Times differ between machines; ratios less so.
//
//   bench_rbf [--runs N] [--scale S] [--only fit|rival|reduce|evaluate|growth]
//
// --scale shrinks every set, so that a test can see that it works.
#include <libalglib/interpolation.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/mesh/polygonise.h"
#include "core/phantom/phantom.h"
#include "core/rbf/rbf.h"
#include "core/rbf/simd_sums.h"

namespace spinaltap {
namespace {

struct Options {
  int runs = 3;
  double scale = 1;
  std::string only;

  [[nodiscard]] std::size_t scaled(std::size_t n) const {
    return std::max<std::size_t>(300, static_cast<std::size_t>(static_cast<double>(n) * scale));
  }
  [[nodiscard]] bool wants(const char* part) const { return only.empty() || only == part; }
};

struct Times {
  std::vector<double> s;
  [[nodiscard]] double median() const { return s[s.size() / 2]; }
};

Times timed(int runs, const std::function<void()>& work) {
  Times out;
  for (int run = 0; run < runs; ++run) {
    const auto start = std::chrono::steady_clock::now();
    work();
    out.s.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(out.s.begin(), out.s.end());
  return out;
}

std::string spread(const Times& t) {
  char text[64];
  std::snprintf(text, sizeof text, "%8.3f s (%.3f to %.3f)", t.median(), t.s.front(), t.s.back());
  return text;
}

/// The phantom's exact surface as triangles.
mesh::TriangleMesh surfaceOf(const phantom::Phantom& bone) {
  const phantom::Bounds box = bone.bounds();
  const std::vector<Vec3> seeds{bone.pedicle(phantom::Side::Left).entry_patient};
  mesh::PolygoniseOptions options;
  options.cell_mm = 0.7, options.low_patient = box.low_patient, options.high_patient = box.high_patient;
  return *mesh::polygonise(bone.field(), seeds, options);
}

/// A third of the samples on the surface, evenly spread, a third 1 mm outside and a third 1 mm inside, with the
/// phantom's own values; `noise_mm` moves each of them along the normal.
rbf::Samples samplesOf(const phantom::Phantom& bone, const mesh::TriangleMesh& surface, std::size_t count,
                       double noise_mm) {
  Random random(count);
  std::vector<double> area{0};
  for (const auto& t : surface.triangles) {
    const Vec3& a = surface.vertices[t[0]];
    area.push_back(area.back() + norm(cross(surface.vertices[t[1]] - a, surface.vertices[t[2]] - a)));
  }
  rbf::Samples out;
  for (std::size_t i = 0; i * 3 < count; ++i) {
    // One point a stratum of equal area: as even as boundary samples are.
    const double at =
        area.back() * (static_cast<double>(i) + random.uniform(0, 1)) * 3 / static_cast<double>(count + 3);
    const auto t =
        surface
            .triangles[static_cast<std::size_t>(std::upper_bound(area.begin(), area.end() - 1, at) - area.begin()) - 1];
    double u = random.uniform(0, 1), v = random.uniform(0, 1);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vec3& a = surface.vertices[t[0]];
    const Vec3 p = a + (surface.vertices[t[1]] - a) * u + (surface.vertices[t[2]] - a) * v;
    const Vec3 normal = normalized(bone.gradient(p));
    const double error = noise_mm * random.gaussian();
    for (const double offset : {0.0, 1.0, -1.0}) {
      out.positions.push_back(p + normal * (offset + error));
      out.distances_mm.push_back(noise_mm > 0 ? offset : bone.signedDistance(out.positions.back()));
    }
  }
  return out;
}

void benchFit(const Options& o, const phantom::Phantom& bone, const mesh::TriangleMesh& surface) {
  std::printf("\nfit to 0.01 mm\n%9s %9s %7s %12s %12s %12s  %s\n", "samples", "centres", "rounds", "max mm", "rms mm",
              "sum |w|", "seconds");
  for (const std::size_t n : {44'000UL, 88'000UL, 132'450UL}) {
    const rbf::Samples samples = samplesOf(bone, surface, o.scaled(n), 0);
    rbf::FitReport report;
    const Times t = timed(o.runs, [&] { report = rbf::fit(samples, {.tolerance_mm = 0.01}).value().report; });
    std::printf("%9zu %9zu %7d %12.4g %12.4g %12.4g %s\n", report.samples, report.centres, report.rounds,
                report.residual_max_mm, report.residual_rms_mm, report.sum_abs_weights, spread(t).c_str());
  }
}

void benchReduce(const Options& o, const phantom::Phantom& bone, const mesh::TriangleMesh& surface) {
  const rbf::Samples samples = samplesOf(bone, surface, o.scaled(88'000), 0.1);
  rbf::FitReport r;
  const Times t = timed(o.runs, [&] {
    r = rbf::fit(samples, {.tolerance_mm = 0.01, .smoothing = rbf::kAutoSmoothing, .reduce_mm = 0.05}).value().report;
  });
  std::printf(
      "\nsmooth, then reduce to 0.05 mm (noise 0.1 mm): %zu samples, noise found %.3f mm, ridge %.3g mm, %zu centres, "
      "reduction %.3g mm, residual rms %.3g mm: %s\n",
      r.samples, r.noise_mm, r.smoothing, r.centres, r.reduction_max_mm, r.residual_rms_mm, spread(t).c_str());
}

void benchGrowth(const Options& o, const phantom::Phantom& bone, const mesh::TriangleMesh& surface) {
  std::printf("\ngrowth with the number of samples, to 0.01 mm\n%9s %7s %10s  %s\n", "samples", "rounds", "to half",
              "seconds");
  double before = 0;
  for (std::size_t n = 15'625; n <= 500'000; n *= 2) {
    const rbf::Samples samples = samplesOf(bone, surface, o.scaled(n), 0);
    rbf::FitReport report;
    const Times t = timed(o.runs, [&] { report = rbf::fit(samples, {.tolerance_mm = 0.01}).value().report; });
    std::printf("%9zu %7d %10.2f %s\n", report.samples, report.rounds, before > 0 ? t.median() / before : 0.0,
                spread(t).c_str());
    before = t.median();
  }
}

/// Debian's library: a biharmonic fit by its own fast solver.
void benchRival(const Options& o, const phantom::Phantom& bone, const mesh::TriangleMesh& surface) {
  const rbf::Samples samples = samplesOf(bone, surface, o.scaled(10'000), 0);
  alglib::real_2d_array rows;
  rows.setlength(static_cast<alglib::ae_int_t>(samples.positions.size()), 4);
  for (std::size_t i = 0; i < samples.positions.size(); ++i) {
    const Vec3& p = samples.positions[i];
    double* const row = rows[static_cast<alglib::ae_int_t>(i)];
    row[0] = p.x, row[1] = p.y, row[2] = p.z, row[3] = samples.distances_mm[i];
  }
  double worst = 0;
  const Times theirs = timed(1, [&] {
    alglib::rbfmodel model;
    alglib::rbfcreate(3, 1, model);
    alglib::rbfsetpoints(model, rows);
    alglib::rbfsetalgobiharmonic(model, 0.0);
    alglib::rbfreport report;
    alglib::rbfbuildmodel(model, report);
    worst = report.maxerror;
  });
  rbf::FitReport report;
  const Times ours =
      timed(o.runs, [&] { report = rbf::fit(samples, {.tolerance_mm = std::max(worst, 1e-9)}).value().report; });
  std::printf("\n%zu samples: libalglib %s to %.2g mm, ours %s to %.2g mm: %.0f times as fast\n",
              samples.positions.size(), spread(theirs).c_str(), worst, spread(ours).c_str(), report.residual_max_mm,
              theirs.median() / ours.median());
}

void benchEvaluate(const Options& o, const phantom::Phantom& bone, const mesh::TriangleMesh& surface) {
  const rbf::Fit fit = rbf::fit(samplesOf(bone, surface, o.scaled(15'000), 0), {.tolerance_mm = 0.01}).value();
  const phantom::Bounds box = bone.bounds();
  Random random(1);
  std::vector<Vec3> points(o.scaled(1'000'000));
  for (Vec3& p : points) {
    p = {random.uniform(box.low_patient.x, box.high_patient.x), random.uniform(box.low_patient.y, box.high_patient.y),
         random.uniform(box.low_patient.z, box.high_patient.z)};
  }
  std::vector<double> direct(points.size()), fast(points.size());
  std::vector<Vec3> slopes(points.size());
  const Times made = timed(o.runs, [&] { const rbf::Evaluator evaluator(fit.model, 1e-4); });
  const rbf::Evaluator evaluator(fit.model, 1e-4);
  const Times ours = timed(o.runs, [&] { evaluator.values(points, fast); });
  const Times sloping = timed(o.runs, [&] { evaluator.gradients(points, slopes); });
  const Times theirs = timed(1, [&] { rbf::evaluate(fit.model, points, direct); });
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) worst = std::max(worst, std::abs(direct[i] - fast[i]));
  std::printf(
      "\n%zu points from %zu centres to 1e-4 mm (largest error %.2g): made %s, values %s, gradients %s; direct with "
      "SIMD %s: %.0f times as fast\n",
      points.size(), fit.model.centres.size(), worst, spread(made).c_str(), spread(ours).c_str(),
      spread(sloping).c_str(), spread(theirs).c_str(), theirs.median() / ours.median());
}

bool parse(int argc, char** argv, Options& o) {
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string key = argv[i];
    if (key == "--runs")
      o.runs = std::atoi(argv[i + 1]);
    else if (key == "--scale")
      o.scale = std::atof(argv[i + 1]);
    else if (key == "--only")
      o.only = argv[i + 1];
    else
      return false;
  }
  return argc % 2 == 1 && o.runs >= 1 && o.scale > 0 && o.scale <= 1;
}

int run(int argc, char** argv) {
  Options options;
  if (!parse(argc, argv, options)) {
    std::fprintf(stderr, "usage: bench_rbf [--runs N] [--scale S] [--only fit|rival|reduce|evaluate|growth]\n");
    return 2;
  }
  const phantom::Phantom bone = phantom::Phantom::make({});
  const mesh::TriangleMesh surface = surfaceOf(bone);
  if (options.wants("fit")) benchFit(options, bone, surface);
  if (options.wants("reduce")) benchReduce(options, bone, surface);
  if (options.wants("evaluate")) benchEvaluate(options, bone, surface);
  if (options.wants("growth")) benchGrowth(options, bone, surface);
  if (options.wants("rival")) benchRival(options, bone, surface);
  return 0;
}

}  // namespace
}  // namespace spinaltap

int main(int argc, char** argv) { return spinaltap::run(argc, argv); }
