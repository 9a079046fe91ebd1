#include "tests/server/segment/scores.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/base/random.h"
#include "core/segment/distance.h"
#include "core/volume/crop.h"

namespace spinaltap::test {
namespace {

using segment::Mask;

constexpr const char* kVerse = "verse-014/sub-verse014_ct.nii.gz";
constexpr const char* kVerseLabel = "verse-014/sub-verse014_seg-vert_msk.nii.gz";

/// Voxels that share a face with one outside.
Mask boundaryOf(const volume::LabelVolume& label) {
  const auto& d = label.grid.dims;
  Mask out{d, label.grid.spacing_mm, std::vector<std::uint8_t>(label.inside.size(), 0)};
  const auto inside = [&](int i, int j, int k) {
    return label.grid.contains(i, j, k) && label.inside[label.grid.index(i, j, k)] != 0;
  };
  for (int k = 0; k < d[2]; ++k)
    for (int j = 0; j < d[1]; ++j)
      for (int i = 0; i < d[0]; ++i) {
        const bool deep = inside(i - 1, j, k) && inside(i + 1, j, k) && inside(i, j - 1, k) && inside(i, j + 1, k) &&
                          inside(i, j, k - 1) && inside(i, j, k + 1);
        out.set[out.index(i, j, k)] = inside(i, j, k) && !deep ? 1 : 0;
      }
  return out;
}

void addDistances(const Mask& from, const Mask& to, std::vector<double>& distances) {
  const std::vector<float> square = segment::squaredDistances(to, 1);
  for (std::size_t v = 0; v < square.size(); ++v) {
    if (from.set[v] != 0) distances.push_back(std::sqrt(square[v]));
  }
}

}  // namespace

const std::vector<LabelledCase>& labelledCases() {
  static const std::vector<LabelledCase> kCases{{"verse-014 L1", kVerse, kVerseLabel, 20, {-17.9, 195.0, -76.9}},
                                                {"verse-014 L2", kVerse, kVerseLabel, 21, {-22.1, 181.9, -101.0}},
                                                {"verse-014 L3", kVerse, kVerseLabel, 22, {-24.5, 172.3, -131.7}},
                                                {"verse-014 L4", kVerse, kVerseLabel, 23, {-27.3, 175.7, -164.7}},
                                                {"verse-014 L5", kVerse, kVerseLabel, 24, {-27.4, 197.2, -188.5}},
                                                {"tptbox L3",
                                                 "tptbox-l3/sub-ct_label-22_ct.nii.gz",
                                                 "tptbox-l3/sub-ct_seg-vert_label-22_msk.nii.gz",
                                                 22,
                                                 {26.0, 161.6, -64.9}}};
  return kCases;
}

Score compare(const volume::LabelVolume& ours, const volume::LabelVolume& truth) {
  Score score;
  std::size_t both = 0, sum = 0;
  volume::LabelVolume either = truth;
  for (std::size_t v = 0; v < truth.inside.size(); ++v) {
    both += ours.inside[v] != 0 && truth.inside[v] != 0 ? 1 : 0;
    sum += (ours.inside[v] != 0 ? 1 : 0) + (truth.inside[v] != 0 ? 1 : 0);
    either.inside[v] |= ours.inside[v];
  }
  score.dice = 2.0 * static_cast<double>(both) / static_cast<double>(sum);
  const auto box = volume::boundsOf(either).value();
  const Mask a = boundaryOf(volume::cropTo(ours, box.low, box.high).value());
  const Mask b = boundaryOf(volume::cropTo(truth, box.low, box.high).value());
  std::vector<double> distances;
  addDistances(a, b, distances), addDistances(b, a, distances);
  std::sort(distances.begin(), distances.end());
  for (const double d : distances) score.mean_mm += d / static_cast<double>(distances.size());
  score.percentile95_mm = distances[static_cast<std::size_t>(0.95 * static_cast<double>(distances.size() - 1))];
  return score;
}

Result<Score> scoreClick(const importer::ImportedVolume& scan, const Vec3& click) {
  segment::IsolateOptions options;
  options.seed_patient = click;
  const auto start = std::chrono::steady_clock::now();
  const auto found = segment::isolate(scan.ct, options);
  if (!found) return tl::unexpected(found.error());
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  Score score = compare(found->label, *scan.label);
  score.seconds = seconds;
  return score;
}

std::vector<Vec3> clicksAround(const Vec3& body, double radius_mm, int count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Vec3> clicks{body};
  while (static_cast<int>(clicks.size()) < count) {
    const Vec3 off{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    if (norm(off) <= 1) clicks.push_back(body + off * radius_mm);
  }
  return clicks;
}

Result<importer::ImportedVolume> load(const std::filesystem::path& folder, const LabelledCase& one) {
  importer::ImportRequest request;
  request.from = folder / one.ct;
  request.label = importer::LabelRequest{folder / one.label, one.value};
  return importer::importVolume(request);
}

}  // namespace spinaltap::test
