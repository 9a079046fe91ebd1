// The polygoniser beside marching cubes on a dense grid, in one process: on the phantom's own field, whose surface is
// known, and on an RBF fitted to it. Then what simplification leaves. Times differ between machines; ratios less so.
//
//   bench_mesh [--cell-um N] [--repeats N]
//
// `own` is the time spent outside the field. The error is that of random points of the triangles, to the field's own
// zero set (by a Newton step, for the RBF).
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/phantom/phantom.h"
#include "core/rbf/rbf.h"
#include "server/mesh_out/simplify.h"
#include "tests/bench/marching_cubes.h"
#include "tests/core/mesh/mesh_check.h"

namespace spinaltap {
namespace {

using Clock = std::chrono::steady_clock;
double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct Options {
  int cell_um = 500, repeats = 5;
};

struct Counts {
  std::size_t values = 0, gradients = 0, calls = 0;
  double field_s = 0;
};

Field counted(const Field& field, Counts& counts) {
  Field out;
  out.values = [&field, &counts](std::span<const Vec3> p, std::span<double> to) {
    const auto start = Clock::now();
    field.values(p, to);
    counts.field_s += secondsSince(start), counts.values += p.size(), ++counts.calls;
  };
  out.gradients = [&field, &counts](std::span<const Vec3> p, std::span<Vec3> to) {
    const auto start = Clock::now();
    field.gradients(p, to);
    counts.field_s += secondsSince(start), counts.gradients += p.size(), ++counts.calls;
  };
  return out;
}

struct Run {
  std::vector<double> total_s, own_s;
  Counts counts;
  mesh::TriangleMesh mesh;
};

double quantile(std::vector<double> of, double q) {
  std::sort(of.begin(), of.end());
  return of[static_cast<std::size_t>(q * double(of.size() - 1) + 0.5)];
}

template <class Make>
Run run(const Field& field, int repeats, const Make& make) {
  Run out;
  for (int n = 0; n < repeats; ++n) {
    out.counts = {};
    const Field asked = counted(field, out.counts);
    const auto start = Clock::now();
    out.mesh = make(asked);
    out.total_s.push_back(secondsSince(start));
    out.own_s.push_back(out.total_s.back() - out.counts.field_s);
  }
  return out;
}

/// RMS over points spread evenly over the area, in um.
double error_um(const mesh::TriangleMesh& mesh, const Field& field) {
  Random random(5);
  std::vector<Vec3> points;
  double carried = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    for (carried += norm(cross(b - a, c - a)) / 2; carried > 2; carried -= 2) {  // one for each 2 mm^2
      double u = random.unit(), v = random.unit();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      points.push_back(a * (1 - u - v) + b * u + c * v);
    }
  }
  std::vector<double> values(points.size());
  std::vector<Vec3> slopes(points.size());
  field.values(points, values), field.gradients(points, slopes);
  double squares = 0;
  for (std::size_t i = 0; i < points.size(); ++i) squares += std::pow(values[i] / norm(slopes[i]), 2);
  return 1000 * std::sqrt(squares / double(points.size()));
}

void print(const char* name, const Run& run, const Field& field) {
  const mesh::MeshCheck check = mesh::check(run.mesh);
  std::printf("  %-16s %8.3f (%.3f-%.3f) %8.3f %9zu %9zu %6zu %9zu %8.2f %8.2f  %s\n", name, quantile(run.total_s, 0.5),
              quantile(run.total_s, 0.1), quantile(run.total_s, 0.9), quantile(run.own_s, 0.5), run.counts.values,
              run.counts.gradients, run.counts.calls, run.mesh.triangles.size(), check.least_angle_deg,
              error_um(run.mesh, field), check.open_edges + check.pinched_vertices == 0 ? "closed" : "NOT CLOSED");
}

mesh::TriangleMesh orEnd(Result<mesh::TriangleMesh> made) {
  if (made) return std::move(*made);
  std::fprintf(stderr, "bench_mesh: %s\n", made.error().message.c_str());
  std::exit(1);
}

mesh::TriangleMesh compare(const char* title, const Field& field, const std::vector<Vec3>& seeds,
                           const mesh::PolygoniseOptions& box, int repeats) {
  std::printf("%s, %.2f mm, %zu seeds\n  %-16s %24s %8s %9s %9s %6s %9s %8s %8s\n", title, box.cell_mm, seeds.size(),
              "", "seconds (10-90 %)", "own", "values", "gradients", "calls", "triangles", "angle", "RMS um");
  Run ours = run(field, repeats, [&](const Field& f) { return orEnd(mesh::polygonise(f, seeds, box)); });
  const Run rival = run(field, 1, [&](const Field& f) { return mesh::marchingCubes(f, box); });
  print("ours", ours, field);
  print("marching cubes", rival, field);
  std::printf("  rival / ours: %.1f times the seconds, %.1f times the values\n",
              rival.total_s[0] / quantile(ours.total_s, 0.5), double(rival.counts.values) / double(ours.counts.values));
  return std::move(ours.mesh);
}

/// Points about 1 mm apart, up to 0.15 mm off the surface, as a reconstruction's are.
std::vector<Vec3> seedsOn(const mesh::TriangleMesh& fine) {
  Random random(3);
  std::vector<Vec3> seeds;
  for (std::size_t v = 0; v < fine.vertices.size(); v += 2) {
    seeds.push_back(fine.vertices[v] + fine.normals[v] * random.uniform(-0.15, 0.15));
  }
  return seeds;
}

Field fittedField(const mesh::TriangleMesh& surface) {
  rbf::Samples samples;
  for (std::size_t v = 0; v < surface.vertices.size(); v += 4) {
    for (const double off_mm : {-1.0, 0.0, 1.0}) {
      samples.positions.push_back(surface.vertices[v] + surface.normals[v] * off_mm);
      samples.distances_mm.push_back(off_mm);
    }
  }
  const auto fit = rbf::fit(samples, {.reduce_mm = 0.05});
  if (!fit) {
    std::fprintf(stderr, "bench_mesh: %s\n", fit.error().message.c_str());
    std::exit(1);
  }
  return rbf::asField(fit->model, std::numeric_limits<double>::infinity(), 1e-3);
}

void simplifyTable(const mesh::TriangleMesh& mesh) {
  std::printf("simplified, both ways within\n");
  for (const double error_mm : {0.5, 0.2, 0.1, 0.05}) {
    const auto start = Clock::now();
    const auto made = mesh_out::simplify(mesh, error_mm);
    if (!made) continue;
    std::printf("  %.2f mm: %7zu of %zu triangles, %.2f s\n", error_mm, made->triangles.size(), mesh.triangles.size(),
                secondsSince(start));
  }
}

bool parse(int argc, char** argv, Options& options) {
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string key = argv[i];
    const int value = std::atoi(argv[i + 1]);
    if (value < 1 || value > 100'000) return false;
    if (key == "--cell-um") {
      options.cell_um = value;
    } else if (key == "--repeats") {
      options.repeats = value;
    } else {
      return false;
    }
  }
  return argc % 2 == 1;
}

void bench(const Options& options) {
  const auto phantom = phantom::Phantom::make({.seed = 1});
  const Vec3 margin{4, 4, 4};
  mesh::PolygoniseOptions box{1, phantom.bounds().low_patient - margin, phantom.bounds().high_patient + margin};
  const Field exact = phantom.field();
  const auto coarse =
      orEnd(mesh::polygonise(exact, std::vector<Vec3>{phantom.pedicle(phantom::Side::Left).entry_patient}, box));
  const std::vector<Vec3> seeds = seedsOn(coarse);
  box.cell_mm = options.cell_um / 1000.0;
  const auto bone = compare("the phantom's field", exact, seeds, box, options.repeats);
  compare("an RBF", fittedField(coarse), seeds, box, options.repeats);
  simplifyTable(bone);
}

}  // namespace
}  // namespace spinaltap

int main(int argc, char** argv) {
  spinaltap::Options options;
  if (!spinaltap::parse(argc, argv, options)) {
    std::fprintf(stderr, "usage: bench_mesh [--cell-um N] [--repeats N]\n");
    return 2;
  }
  spinaltap::bench(options);
  return 0;
}
