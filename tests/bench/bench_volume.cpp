// Building the point volume of a realistic path (378 discs of 30 rings at 0.1 mm: 986,958 points) beside evaluating the
// field at every point, in one process: on the phantom's own field and on an RBF fitted to its surface, as the program
// does it, with the bound and the sums that are made first. Then how soon the first millimetres are there when discs
// are built ahead of the bit. Times differ between machines; ratios less so. CPU seconds are of all threads.
//
//   bench_volume [--runs N] [--samples N] [--length-um N] [--spacing-um N] [--threads N] [--direct 1]
//
// --direct 1 also sums the RBF directly at every point, once: the truth, and minutes of CPU below 0.1 mm.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/mesh/polygonise.h"
#include "core/phantom/ct.h"
#include "core/phantom/phantom.h"
#include "core/plan/path.h"
#include "core/point_volume/pieces.h"
#include "core/rbf/rbf.h"
#include "core/volume/sample.h"
#include "server/jobs/local_bound.h"

namespace spinaltap {
namespace {

constexpr double kTolerance_mm = 1e-4;

struct Options {
  int runs = 5, samples = 24'000, length_um = 37'800, spacing_um = 100, threads = 0, direct = 0;
};

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double cpuSeconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

struct Times {
  std::vector<double> s, cpu_s;
  [[nodiscard]] double median() const { return s[s.size() / 2]; }
};

Times timed(int runs, const std::function<void()>& work) {
  Times out;
  for (int run = 0; run < runs; ++run) {
    const double cpu = cpuSeconds();
    const auto start = std::chrono::steady_clock::now();
    work();
    out.s.push_back(secondsSince(start)), out.cpu_s.push_back(cpuSeconds() - cpu);
  }
  std::sort(out.s.begin(), out.s.end()), std::sort(out.cpu_s.begin(), out.cpu_s.end());
  return out;
}

std::string spread(const Times& t) {
  char text[80];
  std::snprintf(text, sizeof text, "%7.3f s (%.3f to %.3f), CPU %6.3f s", t.median(), t.s.front(), t.s.back(),
                t.cpu_s[t.cpu_s.size() / 2]);
  return text;
}

/// Where the field's share of the time went.
struct Asked {
  std::size_t values = 0, calls = 0;
  double field_s = 0;
};

struct Scene {
  point_volume::Lattice lattice;
  Frame frame;
  volume::CtVolume ct;
};

point_volume::HuSampler samplerOf(const Scene& scene) {
  return [&scene](std::span<const Vec3> p, std::span<double> out) {
    for (std::size_t i = 0; i < p.size(); ++i) out[i] = volume::sampleHu(scene.ct, p[i]);
  };
}

Field counted(const Field& field, Asked& asked) {
  Field out = field;
  out.values = [&field, &asked](std::span<const Vec3> p, std::span<double> to) {
    const auto start = std::chrono::steady_clock::now();
    field.values(p, to);
    asked.field_s += secondsSince(start), asked.values += p.size(), ++asked.calls;
  };
  return out;
}

void row(const char* name, const Times& t, const Asked& asked) {
  std::printf("  %-12s %s, field %.3f s, %zu values in %zu calls\n", name, spread(t).c_str(), asked.field_s,
              asked.values, asked.calls);
}

point_volume::PointVolume build(const Scene& scene, const Field& field, const Options& o) {
  return point_volume::buildVolume(scene.lattice, scene.frame, field, samplerOf(scene),
                                   static_cast<unsigned>(o.threads))
      .value();
}

void compare(const char* title, const Scene& scene, const Field& field, const Options& o) {
  std::printf("%s: no steeper than %.2f\n", title, field.lipschitz);
  point_volume::PointVolume ours, every;
  Asked asked, asked_every;
  const Times quick = timed(o.runs, [&] {
    asked = {};
    ours = build(scene, counted(field, asked), o);
  });
  row("ours", quick, asked);
  Field all = field;
  all.lipschitz = std::numeric_limits<double>::infinity();
  const Times slow = timed(std::min(o.runs, 3), [&] {
    asked_every = {};
    every = build(scene, counted(all, asked_every), o);
  });
  row("every point", slow, asked_every);
  const bool same = ours.alive == every.alive && ours.density_mg_cm3 == every.density_mg_cm3;
  std::printf("  every point / ours: %.1f times the seconds, %.1f times the values; %llu alive, %s\n",
              slow.median() / quick.median(), double(asked_every.values) / double(asked.values),
              static_cast<unsigned long long>(point_volume::countAlive(ours)),
              same ? "the same volume" : "NOT THE SAME VOLUME");
}

/// Whether points are decided as direct sums at every one of them decide.
void direct(const Scene& scene, const rbf::Model& model, const Field& field, const Options& o) {
  point_volume::PointVolume every;
  const Field slow = rbf::asField(model, std::numeric_limits<double>::infinity());
  const Times t = timed(1, [&] { every = build(scene, slow, o); });
  std::printf("  every point directly %s; %s\n", spread(t).c_str(),
              build(scene, field, o).alive == every.alive ? "the same points" : "NOT THE SAME POINTS");
}

/// The first millimetres, and the rest in pieces of one millimetre, beside the whole at once.
void ahead(const Scene& scene, const Field& field, const Options& o) {
  const point_volume::Lattice& l = scene.lattice;
  const auto threads = static_cast<unsigned>(o.threads);
  const point_volume::PointVolume whole = build(scene, field, o);
  const auto discs = [&](double mm) {
    return std::min(l.discs, std::max(1, static_cast<int>(mm / l.spacing_mm + 0.5)));
  };
  point_volume::PointVolume volume;
  const auto put = [&](int from, int to) {
    place(*point_volume::buildDiscs(l, from, to, scene.frame, field, samplerOf(scene), threads), from, volume);
  };
  for (const double mm : {1.0, 2.0, 5.0, 10.0}) {
    const Times t = timed(o.runs, [&] { volume = *point_volume::emptyVolume(l), put(0, discs(mm)); });
    std::printf("  first %4.0f mm %s\n", mm, spread(t).c_str());
  }
  Times each;
  const Times all = timed(o.runs, [&] {
    volume = *point_volume::emptyVolume(l);
    for (int from = 0; from < l.discs; from += discs(1)) {
      const auto start = std::chrono::steady_clock::now();
      put(from, std::min(l.discs, from + discs(1)));
      each.s.push_back(secondsSince(start));
    }
  });
  std::sort(each.s.begin(), each.s.end());
  const bool same = volume.alive == whole.alive && volume.density_mg_cm3 == whole.density_mg_cm3;
  std::printf("  all, 1 mm each %s; a piece %.4f s, at most %.4f s; %s\n", spread(all).c_str(), each.median(),
              each.s.back(), same ? "the same volume" : "NOT THE SAME VOLUME");
}

mesh::TriangleMesh surfaceOf(const phantom::Phantom& bone) {
  const std::vector<Vec3> seeds{bone.pedicle(phantom::Side::Left).entry_patient};
  return *mesh::polygonise(bone.field(), seeds, {0.7, bone.bounds().low_patient, bone.bounds().high_patient});
}

rbf::Model modelOf(const phantom::Phantom& bone, std::size_t count) {
  const mesh::TriangleMesh surface = surfaceOf(bone);
  Random random(9);
  rbf::Samples samples;
  const std::size_t wanted = std::min(surface.vertices.size(), count / 3);
  for (std::size_t n = 0; n < wanted; ++n) {
    const std::size_t v = n * surface.vertices.size() / wanted;
    const double noise_mm = 0.05 * random.gaussian();
    for (const double off_mm : {-1.0, 0.0, 1.0}) {
      samples.positions.push_back(surface.vertices[v] + surface.normals[v] * (off_mm + noise_mm));
      samples.distances_mm.push_back(off_mm);
    }
  }
  const auto fit = rbf::fit(samples, {.smoothing = rbf::kAutoSmoothing, .reduce_mm = 0.05});
  return fit->model;
}

void benchModel(const phantom::Phantom& bone, const Scene& scene, const Options& o) {
  const point_volume::Lattice& l = scene.lattice;
  const rbf::Model model = modelOf(bone, static_cast<std::size_t>(o.samples));
  const jobs::Cylinder around{scene.frame, l.rings * l.spacing_mm, l.discZ_mm(-1), l.discZ_mm(l.discs)};
  Field field;
  const Times bound = timed(o.runs, [&] { field.lipschitz = jobs::lipschitzIn(model, around, unsigned(o.threads)); });
  const Times sums = timed(o.runs, [&] {
    const Field made = rbf::asField(model, field.lipschitz, kTolerance_mm);
    field = made;
  });
  field.error_mm = kTolerance_mm, field.exact = rbf::asField(model, field.lipschitz).values;
  std::printf("RBF of %zu centres\n  bound        %s\n  fast sums    %s\n", model.centres.size(), spread(bound).c_str(),
              spread(sums).c_str());
  compare("RBF", scene, field, o);
  if (o.direct != 0) direct(scene, model, field, o);
  ahead(scene, field, o);
}

void bench(const Options& o) {
  const auto bone = phantom::Phantom::make({.seed = 1});
  const phantom::PediclePath& pedicle = bone.pedicle(phantom::Side::Left);
  plan::Path path;
  path.entry_patient = pedicle.entry_patient, path.target_patient = pedicle.target_patient;
  Scene scene;
  scene.frame = plan::pathFrame(path);
  const double spacing_mm = o.spacing_um / 1000.0;
  // 3 mm around, 2 mm before the entry
  scene.lattice = {spacing_mm, static_cast<int>(3 / spacing_mm + 0.5), std::max(1, o.length_um / o.spacing_um),
                   -static_cast<int>(2 / spacing_mm + 0.5)};
  scene.ct = phantom::sampleCt(bone, phantom::CtOptions::coarser(3)).value();
  std::printf("%llu points: %d discs of %d rings\n", static_cast<unsigned long long>(scene.lattice.points()),
              scene.lattice.discs, scene.lattice.rings);
  compare("phantom's own field", scene, bone.field(), o);
  benchModel(bone, scene, o);
}

bool parse(int argc, char** argv, Options& o) {
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string key = argv[i];
    const int value = std::atoi(argv[i + 1]);
    if (value < 1 || value > 1'000'000) return false;
    if (key == "--runs")
      o.runs = value;
    else if (key == "--samples")
      o.samples = value;
    else if (key == "--length-um")
      o.length_um = value;
    else if (key == "--spacing-um")
      o.spacing_um = value;
    else if (key == "--threads")
      o.threads = value;
    else if (key == "--direct")
      o.direct = value;
    else
      return false;
  }
  return argc % 2 == 1;
}

}  // namespace
}  // namespace spinaltap

int main(int argc, char** argv) {
  spinaltap::Options options;
  if (!spinaltap::parse(argc, argv, options)) {
    std::fprintf(stderr,
                 "usage: bench_volume [--runs N] [--samples N] [--length-um N] [--spacing-um N] [--threads N] "
                 "[--direct 1]\n");
    return 2;
  }
  spinaltap::bench(options);
  return 0;
}
