#include "server/jobs/build_site.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "core/mesh/polygonise.h"
#include "core/phantom/ct.h"
#include "core/plan/path.h"
#include "core/point_volume/point_volume.h"
#include "core/volume/sample.h"
#include "server/jobs/figures.h"
#include "server/jobs/local_bound.h"

namespace spinaltap::jobs {
namespace {

constexpr double kFieldTolerance_mm = 1e-4;  // as plan_job has it
constexpr double kReduce_mm = 0.05;          // as reconstruct does
constexpr double kCell_mm = 0.7, kOff_mm = 1;

/// On the phantom's surface, and a millimetre off it on both sides.
Result<rbf::Samples> samplesOf(const phantom::Phantom& bone, std::size_t count) {
  const std::vector<Vec3> seeds{bone.pedicle(phantom::Side::Left).entry_patient};
  const auto mesh =
      mesh::polygonise(bone.field(), seeds, {kCell_mm, bone.bounds().low_patient, bone.bounds().high_patient});
  if (!mesh) return tl::unexpected(mesh.error());
  rbf::Samples samples;
  const std::size_t wanted = std::min(mesh->vertices.size(), count / 3);
  for (std::size_t n = 0; n < wanted; ++n) {
    const std::size_t v = n * mesh->vertices.size() / wanted;
    for (const double off_mm : {-kOff_mm, 0.0, kOff_mm}) {
      samples.positions.push_back(mesh->vertices[v] + mesh->normals[v] * off_mm);
      samples.distances_mm.push_back(off_mm);
    }
  }
  return samples;
}

/// As rbf::asField, on so many threads.
Field fieldOf(const rbf::Model& model, double lipschitz, unsigned threads) {
  Field field;
  field.lipschitz = lipschitz, field.error_mm = kFieldTolerance_mm;
  field.values = [sums = rbf::Evaluator(model, kFieldTolerance_mm, threads)](
                     std::span<const Vec3> points, std::span<double> out) { sums.values(points, out); };
  field.exact = [&model, threads](std::span<const Vec3> points, std::span<double> out) {
    rbf::evaluate(model, points, out, threads);
  };
  return field;
}

}  // namespace

Result<BuildSite> BuildSite::make(std::size_t samples) {
  const auto bone = phantom::Phantom::make({});
  const auto sampled = samplesOf(bone, samples);
  if (!sampled) return tl::unexpected(sampled.error());
  auto fit = rbf::fit(*sampled, {.smoothing = rbf::kAutoSmoothing, .reduce_mm = kReduce_mm});
  if (!fit) return tl::unexpected(fit.error());
  auto ct = phantom::sampleCt(bone, phantom::CtOptions::coarser(3));
  if (!ct) return tl::unexpected(ct.error());
  BuildSite site;
  plan::Path path;
  path.entry_patient = bone.pedicle(phantom::Side::Left).entry_patient;
  path.target_patient = bone.pedicle(phantom::Side::Left).target_patient;
  site.frame_ = plan::pathFrame(path);
  site.ct_ = std::move(*ct), site.model_ = std::move(fit->model);
  return site;
}

double BuildSite::sumsOver(const point_volume::Lattice& lattice) {
  Stopwatch watch;
  const double spacing = lattice.spacing_mm;
  lipschitz_ =
      lipschitzIn(model_, {frame_, lattice.rings * spacing, lattice.discZ_mm(-1), lattice.discZ_mm(lattice.discs)});
  std::ignore = fieldOf(model_, lipschitz_, 0);
  return watch.lap_s();
}

Result<double> BuildSite::build_s(const point_volume::Lattice& lattice, int threads, int repeats) const {
  const auto count = static_cast<unsigned>(threads);
  const Field field = fieldOf(model_, lipschitz_, count);
  const auto hu = [this](std::span<const Vec3> points, std::span<double> out) {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = volume::sampleHu(ct_, points[i]);
  };
  double fastest = std::numeric_limits<double>::infinity();
  for (int repeat = 0; repeat < std::max(1, repeats); ++repeat) {
    Stopwatch watch;
    const auto volume = point_volume::buildVolume(lattice, frame_, field, hu, count);
    if (!volume) return tl::unexpected(volume.error());
    fastest = std::min(fastest, watch.lap_s());
  }
  return fastest;
}

}  // namespace spinaltap::jobs
