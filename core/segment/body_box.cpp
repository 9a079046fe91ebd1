#include "core/segment/body_box.h"

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

std::vector<Tilt> tiltsAround() {
  std::vector<Tilt> tilts;
  for (int a = -5; a <= 5; ++a) {
    for (int b = -2; b <= 2; ++b) tilts.push_back({0.15 * a, 0.15 * b});
  }
  return tilts;
}

/// The best pair of plates on a line through a place, given the body's width.
void choosePlates(const Scene& scene, const Vec3& place, const Mat3& guess, double width_mm, BodyBox& box) {
  const std::vector<Tilt> tilts = tiltsAround();
  std::vector<Face> top, bottom;
  std::vector<Vec3> up;
  const auto plate = [&](const Vec3& out, const Mat3& m) {
    const Patch patch{m.col_x, m.col_y, 9, 6, 0};
    return firstDisc(patchProfile(scene.block, scene.block.hu, place, out, patch, 40), kPlate.nearest, kPlate.farthest);
  };
  for (const Tilt& tilt : tilts) {
    const Mat3 m = axesAlong(guess.col_z + guess.col_y * tilt.back + guess.col_x * tilt.left);
    up.push_back(m.col_z);
    top.push_back(plate(guess.col_z, m)), bottom.push_back(plate(-guess.col_z, m));
  }
  for (std::size_t n = 0; n < tilts.size(); ++n) {
    for (std::size_t q = 0; q < tilts.size(); ++q) {
      const double back = tilts[n].back - tilts[q].back, left = tilts[n].left - tilts[q].left;
      const double height = top[n].at_mm + bottom[q].at_mm;
      if (top[n].drop_hu <= 0 || bottom[q].drop_hu <= 0 || height < 12) continue;
      const double score = top[n].drop_hu + bottom[q].drop_hu - 150 * (back * back + left * left) -
                           unlike(height / width_mm, kUsualHeight) - offMiddle(top[n], bottom[q]);
      if (score <= box.score) continue;
      box.score = score, box.top = top[n], box.bottom = bottom[q], box.top_up = up[n], box.bottom_up = up[q];
    }
  }
}

BodyBox boxAt(const Scene& scene, const Vec3& place, const Mat3& guess) {
  const auto drops = [&](const Vec3& from, const Vec3& out, const Patch& patch) {
    return dropsAlong(patchProfile(scene.block, scene.smooth, from, out, patch, 32));
  };
  const auto sides = [&](const Vec3& from, const Mat3& m) {
    const Patch patch{m.col_z, m.col_y, 6, 6, -4};  // in front of where pedicles and transverse processes begin
    return oppositeWalls(drops(from, m.col_x, patch), drops(from, -m.col_x, patch), kSide, 0);
  };
  const auto guessed = sides(place, guess);
  BodyBox box;
  choosePlates(scene, place, guess, guessed.first.at_mm + guessed.second.at_mm, box);
  if (box.score <= -1e299) return box;
  box.frame = {place + guess.col_z * (0.5 * (box.top.at_mm - box.bottom.at_mm)), axesAlong(box.top_up + box.bottom_up)};
  const Mat3& m = box.frame.axes;
  const Vec3& from = box.frame.origin_patient;
  std::tie(box.left, box.right) = sides(from, m);
  const double width = box.left.at_mm + box.right.at_mm;
  const Patch patch{m.col_z, m.col_x, 6, 6, 0};
  std::tie(box.back, box.front) =
      oppositeWalls(drops(from, m.col_y, patch), drops(from, -m.col_y, patch), kDepth, kUsualDepth * width);
  for (const Face* f : {&box.left, &box.right, &box.front, &box.back}) box.score += f->drop_hu;
  box.score -= unlike((box.front.at_mm + box.back.at_mm) / width, kUsualDepth) + 0.5 * unlike(width, kUsualWidth_mm);
  return box;
}

}  // namespace

BodyBox findBox(const Scene& scene, const Vec3& inside, const Vec3& up) {
  const Mat3 guess = axesAlong(up);
  constexpr std::size_t kPlaces = 5;
  std::vector<BodyBox> boxes(kPlaces * kPlaces);
  parallelBlocks(boxes.size(), 1, scene.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t n = from; n < to; ++n) {
      const double x = 4.0 * (static_cast<int>(n % kPlaces) - 2), y = 4.0 * (static_cast<int>(n / kPlaces) - 2);
      boxes[n] = boxAt(scene, inside + guess.col_x * x + guess.col_y * y, guess);
      boxes[n].score -= 0.5 * (x * x + y * y);
    }
  });
  const BodyBox* best = &boxes.front();
  for (const BodyBox& box : boxes) {
    if (box.score > best->score) best = &box;
  }
  return *best;
}

}  // namespace spinaltap::segment
