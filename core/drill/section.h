// core/drill/section.h - circles around and inside the bit's section with each disc. Private to core/drill and its
// tests.
//
// In the plane of a disc let q be measured from the axis, along(q) = c - q . axis with c = (tip.z - z) / axis.z, and
// let u be the cosine of the tilt |axis.z|, v its sine, k = radius / cone length. Then, along the lean and across it,
//   cylinder   u^2 x^2 + y^2 <= R^2                                   an ellipse R / u by R about the axis;
//   cone       u^2 x^2 + y^2 <= k^2 (c - x v)^2, which with g = u^2 - k^2 v^2 > 0 is
//              g (x + k^2 c v / g)^2 + y^2 <= (k c u)^2 / g           an ellipse k c u / g by k c u / sqrt(g),
//              about a point k^2 c v / g from the axis, against the lean.
// The bit is the intersection of both, so each ellipse's longer half axis gives a circle around the section, and the
// shorter one, less what the other body may cut off, a circle inside it.
#pragma once
#include <cmath>

#include "core/drill/engine.h"
#include "core/drill/predicate.h"

namespace spinaltap::drill {

/// Circles about one centre, path frame, mm: every point of the section lies within `outer_mm`, and every point of the
/// disc within `inner_mm` lies in the section, to the predicate's satisfaction. Negative `inner_mm`: there is none.
struct Section {
  double x_mm = 0, y_mm = 0;
  double outer_mm = 0, inner_mm = -1;

  /// Of the centre from the path.
  [[nodiscard]] double away_mm() const { return std::sqrt(x_mm * x_mm + y_mm * y_mm); }
};

/// Which of the two ellipses a section's circles are about. Both hold; the smaller one is the better choice.
enum class About { Shaft, Cone };

/// Outer circles in single precision, linear in the disc's number until the cone meets the cylinder: what is asked of
/// every disc in every cycle. A disc n of them lies `along = along_0 - n * along_step` behind the tip.
struct SectionLine {
  float along_0, along_step;
  float tip_x, tip_y;
  float shaft_x, shaft_y;         ///< the centre moves so much per mm along, in the cylinder
  float cone_x, cone_y;           ///< and in the cone
  float cone_offset, cone_slope;  ///< of the radius in the cone
  float shaft_radius;
  float first_along;  ///< less than that, and the disc is beyond the tip

  /// Of a disc with this outer radius, the smaller of both.
  [[nodiscard]] About about(float outer) const { return outer < shaft_radius ? About::Cone : About::Shaft; }
};

class Sections {
 public:
  /// Circles that also hold what a predicate takes that may be wrong by `slack_mm`. @pre as Engine::step.
  Sections(const BitShape& bit, const BitPose& pose, const point_volume::Lattice& lattice, double slack_mm = 0);

  /// The discs that the bit can touch: first .. last, empty when first > last.
  [[nodiscard]] int first() const { return first_; }
  [[nodiscard]] int last() const { return last_; }
  /// True when the bit lies so flat that circles say nothing.
  [[nodiscard]] bool isFlat() const { return flat_; }

  /// False when the bit has no cone, or one too blunt for the tilt to say anything of.
  [[nodiscard]] bool isConed() const { return coned_; }

  /// Where line() said which circle a disc has, this must be asked for the same: their centres may lie mm apart.
  /// @pre !isFlat(), first() <= disc <= last(); isConed() for About::Cone.
  [[nodiscard]] Section at(int disc, About about) const;
  /// The same outer circles, disc `first` being number 0; by at most 2 * margin_mm() wider.
  [[nodiscard]] SectionLine line(int first) const;
  /// What single precision and the predicate's touch can amount to.
  [[nodiscard]] double margin_mm() const { return margin_mm_; }

 private:
  [[nodiscard]] double along(int disc) const;

  const BitShape& bit_;
  const point_volume::Lattice& lattice_;
  Vec3 tip_mm_, axis_;
  int first_ = 0, last_ = -1;
  bool flat_ = true, coned_ = false;
  double upright_ = 0, lean_ = 0, per_z_ = 0, shaft_outer_ = 0, margin_mm_ = 0;
  double touch_mm_ = 0;                                      ///< what the predicate and doubles can amount to
  double cone_outer_ = 0, cone_inner_ = 0, cone_shift_ = 0;  ///< per mm along
};

}  // namespace spinaltap::drill
