// core/phantom/phantom.h - an L3 vertebra whose true surface, tissue and pedicle axes are known exactly.
// Figures: Panjabi et al., "Human lumbar vertebrae: quantitative three-dimensional anatomy", Spine 17 (1992);
// Zindrick et al., "Analysis of the morphometric characteristics of the thoracic and lumbar pedicles", Spine 12 (1987).
#pragma once
#include <cstdint>
#include <memory>

#include "core/base/field.h"
#include "core/base/frame.h"
#include "core/phantom/anatomy.h"
#include "core/phantom/tissue.h"

namespace spinaltap::phantom {

struct PhantomOptions {
  std::uint64_t seed = 1;     ///< varies the dimensions a little within anatomical limits
  bool osteoporotic = false;  ///< cancellous bone of 60-90 HU in a shell of 0.5 mm instead of 140-230 HU in 1 mm
};

enum class Side { Left, Right };

/// Where a surgeon would drill: along the pedicle's axis, from the back of the bone at the junction of transverse
/// and superior articular process, to 80 % of the body's depth on that line.
struct PediclePath {
  Vec3 entry_patient;    ///< on the true surface
  Vec3 target_patient;   ///< inside the body
  Vec3 isthmus_patient;  ///< on the axis, at the pedicle's narrowest place
  double width_mm = 0;   ///< narrowest width of the pedicle across the axis, outer wall to outer wall
  double height_mm = 0;  ///< its height there
};

/// A box along the patient's axes.
struct Bounds {
  Vec3 low_patient, high_patient;
};

/// Immutable and cheap to copy (the shape is shared); safe to use from several threads.
/// One seed gives the same bits on every target: only + - * / and sqrt are used.
class Phantom {
 public:
  /// Any options are valid.
  [[nodiscard]] static Phantom make(const PhantomOptions& options);

  /// mm, negative inside bone. Its zero set IS the surface, to the bit; away from it the value is close to the distance
  /// within about 3 mm and never more than kLipschitz times it.
  [[nodiscard]] double signedDistance(const Vec3& patient) const;
  /// Gradient of signedDistance by central differences over 2e-5 mm; finite everywhere.
  [[nodiscard]] Vec3 gradient(const Vec3& patient) const;
  /// signedDistance and gradient as a callback, with kLipschitz; keeps the shape alive.
  [[nodiscard]] Field field() const;
  /// |signedDistance(a) - signedDistance(b)| <= kLipschitz |a - b| everywhere. The steepest place found by
  /// climbing from random starts within 250 mm, over 300 seeds, has 1.51; within 60 mm of the bone 1.39.
  static constexpr double kLipschitz = 1.6;

  /// Distance in mm to the surface point that is found nearest, negative inside bone. Within 2 mm of the surface this
  /// is the true distance to 1e-6 mm except near the medial axis; farther away it is an upper bound. Use it to measure.
  [[nodiscard]] double distanceToSurface(const Vec3& patient) const;

  /// HU without noise or blur: bone by depth and place, soft tissue, canal, discs, air. See tissue.cpp.
  [[nodiscard]] double trueHu(const Vec3& patient) const;

  [[nodiscard]] const PediclePath& pedicle(Side side) const;
  /// The vertebra's own axes: origin at the middle of the body, x left, y back, z head.
  [[nodiscard]] const Frame& frame() const;
  [[nodiscard]] const Anatomy& anatomy() const;
  [[nodiscard]] const Tissue& tissue() const;
  [[nodiscard]] const PhantomOptions& options() const;
  /// A place deep in cancellous bone, for region growing.
  [[nodiscard]] Vec3 seedPoint() const;
  /// Holds the whole bone with at least 1 mm to spare.
  [[nodiscard]] Bounds bounds() const;

 private:
  struct State;
  explicit Phantom(std::shared_ptr<const State> state) : state_(std::move(state)) {}
  std::shared_ptr<const State> state_;
};

}  // namespace spinaltap::phantom
