#include "core/segment/body_box.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "core/base/parallel.h"

namespace spinaltap::segment {
namespace {

constexpr double kUsualWidth_mm = 40;
constexpr double kUsualDepth = 0.72, kUsualHeight = 0.68;  // of a body, in parts of its width; L5 to T6 within a third

struct FaceRange {  // mm
  int nearest, farthest;
};
constexpr FaceRange kPlate{3, 26}, kSide{9, 30}, kDepth{4, 24};

/// Penalty for a ratio of lengths that bodies seldom have; a fifth off costs 30 HU.
double unlike(double ratio, double usual) {
  const double off = std::log(ratio / usual);
  return 1000 * off * off;
}

/// Penalty for a place that is not in the middle between two walls: who clicks on a body means its middle.
double offMiddle(const Face& one, const Face& other) {
  const double off = (one.at_mm - other.at_mm) / (one.at_mm + other.at_mm);
  return 300 * off * off;
}

/// Two opposite walls, chosen together. @param usual_mm  their usual distance, 0 when nothing is known of it.
std::pair<Face, Face> oppositeWalls(const std::vector<double>& one, const std::vector<double>& other,
                                    const FaceRange& range, double usual_mm) {
  std::pair<Face, Face> best{{1.0 * range.nearest, 0}, {1.0 * range.nearest, 0}};
  double most = -1e300;
  for (int a = range.nearest; a <= range.farthest && a < static_cast<int>(one.size()); ++a) {
    for (int b = range.nearest; b <= range.farthest && b < static_cast<int>(other.size()); ++b) {
      const std::pair<Face, Face> pair{{1.0 * a, one[static_cast<std::size_t>(a)]},
                                       {1.0 * b, other[static_cast<std::size_t>(b)]}};
      const double score = pair.first.drop_hu + pair.second.drop_hu - offMiddle(pair.first, pair.second) -
                           (usual_mm > 0 ? unlike(a + b, usual_mm) : 0);
      if (score > most) most = score, best = pair;
    }
  }
  return best;
}

/// A tilt of the axis against the guess: slopes towards the back and the left.
struct Tilt {
  double back, left;
};

/// How far to look.
struct Search {
  int places;        ///< to each side of the guess, every 4 mm, along x and y
  int backs, lefts;  ///< tilts to each side of the guess, every 0.15
};

std::vector<Tilt> tiltsAround(const Search& search) {
  std::vector<Tilt> tilts;
  for (int a = -search.backs; a <= search.backs; ++a) {
    for (int b = -search.lefts; b <= search.lefts; ++b) tilts.push_back({0.15 * a, 0.15 * b});
  }
  return tilts;
}

/// The near plate of the first disc in a direction, for each tilt. A worn disc shows as a valley in some tilts and is
/// smeared out in others: what any of them shows counts in all.
std::vector<Face> platesBy(const Scene& scene, const Vec3& place, const Vec3& out, const std::vector<Mat3>& tilted) {
  std::vector<std::vector<double>> profiles;
  std::vector<double> valleys;
  for (const Mat3& m : tilted) {
    const Patch patch{m.col_x, m.col_y, 9, 6, 0};
    profiles.push_back(patchProfile(scene.block, scene.block.hu, place, out, patch, 40));
    const std::vector<double> here = valleysBefore(profiles.back());
    valleys.resize(here.size(), 0);
    for (std::size_t t = 0; t < here.size(); ++t) valleys[t] = std::max(valleys[t], here[t]);
  }
  std::vector<Face> faces;
  for (const auto& profile : profiles) faces.push_back(firstDisc(profile, valleys, kPlate.nearest, kPlate.farthest));
  return faces;
}

/// The best pair of plates on a line through a place, given the body's width.
void choosePlates(const Scene& scene, const Vec3& place, const Mat3& guess, double width_mm,
                  const std::vector<Tilt>& tilts, BodyBox& box) {
  std::vector<Mat3> tilted;
  for (const Tilt& t : tilts) tilted.push_back(axesAlong(guess.col_z + guess.col_y * t.back + guess.col_x * t.left));
  const std::vector<Face> top = platesBy(scene, place, guess.col_z, tilted);
  const std::vector<Face> bottom = platesBy(scene, place, -guess.col_z, tilted);
  for (std::size_t n = 0; n < tilts.size(); ++n) {
    for (std::size_t q = 0; q < tilts.size(); ++q) {
      const double back = tilts[n].back - tilts[q].back, left = tilts[n].left - tilts[q].left;
      const double height = top[n].at_mm + bottom[q].at_mm;
      if (top[n].drop_hu <= 0 || bottom[q].drop_hu <= 0 || height < 12) continue;
      const double score = top[n].drop_hu + bottom[q].drop_hu - 150 * (back * back + left * left) -
                           unlike(height / width_mm, kUsualHeight) - offMiddle(top[n], bottom[q]);
      if (score <= box.score) continue;
      box.score = score, box.top = top[n], box.bottom = bottom[q], box.top_up = tilted[n].col_z,
      box.bottom_up = tilted[q].col_z;
    }
  }
}

BodyBox boxAt(const Scene& scene, const Vec3& place, const Mat3& guess, const std::vector<Tilt>& tilts) {
  const auto drops = [&](const Vec3& from, const Vec3& out, const Patch& patch) {
    return dropsAlong(patchProfile(scene.block, scene.smooth, from, out, patch, 32));
  };
  const auto sides = [&](const Vec3& from, const Mat3& m) {
    const Patch patch{m.col_z, m.col_y, 6, 6, -4};  // in front of where pedicles and transverse processes begin
    return oppositeWalls(drops(from, m.col_x, patch), drops(from, -m.col_x, patch), kSide, 0);
  };
  const auto guessed = sides(place, guess);
  BodyBox box;
  choosePlates(scene, place, guess, guessed.first.at_mm + guessed.second.at_mm, tilts, box);
  if (box.score <= -1e299) return box;
  box.top_through = place + guess.col_z * box.top.at_mm, box.bottom_through = place - guess.col_z * box.bottom.at_mm;
  box.frame = {place + guess.col_z * (0.5 * (box.top.at_mm - box.bottom.at_mm)), axesAlong(box.top_up + box.bottom_up)};
  const Mat3& m = box.frame.axes;
  const Vec3& from = box.frame.origin_patient;
  std::tie(box.left, box.right) = sides(from, m);
  const double width = box.left.at_mm + box.right.at_mm;
  const Patch patch{m.col_z, m.col_x, 6, 6, 0};
  std::tie(box.back, box.front) =
      oppositeWalls(drops(from, m.col_y, patch), drops(from, -m.col_y, patch), kDepth, kUsualDepth * width);
  for (const Face* f : {&box.left, &box.right, &box.front, &box.back}) box.score += f->drop_hu;
  box.score -= unlike((box.front.at_mm + box.back.at_mm) / width, kUsualDepth) + unlike(width, kUsualWidth_mm);
  return box;
}

BodyBox search(const Scene& scene, const Vec3& inside, const Vec3& up, const Search& how) {
  const Mat3 guess = axesAlong(up);
  const std::vector<Tilt> tilts = tiltsAround(how);
  const auto places = static_cast<std::size_t>(2 * how.places + 1);
  std::vector<BodyBox> boxes(places * places);
  parallelBlocks(boxes.size(), 1, scene.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t n = from; n < to; ++n) {
      const double x = 4.0 * (static_cast<int>(n % places) - how.places),
                   y = 4.0 * (static_cast<int>(n / places) - how.places);
      boxes[n] = boxAt(scene, inside + guess.col_x * x + guess.col_y * y, guess, tilts);
      boxes[n].score -= 0.5 * (x * x + y * y);
    }
  });
  const BodyBox* best = &boxes.front();
  for (const BodyBox& box : boxes) {
    if (box.score > best->score) best = &box;
  }
  return *best;
}

}  // namespace

BodyBox findBox(const Scene& scene, const Vec3& inside, const Vec3& up) { return search(scene, inside, up, {2, 5, 2}); }

BodyBox refineBox(const Scene& scene, const BodyBox& found) {
  return search(scene, found.frame.origin_patient, found.frame.axes.col_z, {2, 3, 1});
}

}  // namespace spinaltap::segment
