// core/rbf/rbf.h - implicit surface through signed-distance samples.
// After: Carr et al., "Reconstruction and Representation of 3D Objects with Radial Basis Functions", SIGGRAPH 2001.
#pragma once
#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "core/base/field.h"
#include "core/base/result.h"

namespace spinaltap::rbf {

/// #S positions (mm, patient frame) and #S signed distances (mm, negative inside bone).
struct Samples {
  std::vector<Vec3> positions;
  std::vector<double> distances_mm;
};

/// s(x) = c0 + c . (x - centroid) + sum_i w_i |x - c_i|, the weights orthogonal to linear polynomials.
/// Centres are kept relative to `centroid_patient`, so that a far origin costs no digits.
struct Model {
  Vec3 centroid_patient;
  std::vector<Vec3> centres;    ///< #C, relative to the centroid
  std::vector<double> weights;  ///< #C
  double constant = 0;          ///< c0
  Vec3 linear;                  ///< c
};

struct FitOptions {
  double tolerance_mm = 0.1;  ///< greedy: centres are added until every sample's residual is below this
  double smoothing = 0;       ///< ridge on the kernel's diagonal (mm); 0 interpolates
  std::size_t max_centres = 4000;
};

struct FitReport {
  std::size_t samples = 0, centres = 0;
  double residual_max_mm = 0, residual_rms_mm = 0;  ///< by direct summation at every sample
  double sum_abs_weights = 0;                       ///< large when the set is badly conditioned
  bool reached_tolerance = false;                   ///< false when max_centres came first: the residuals say how far
};

struct Fit {
  Model model;
  FitReport report;
};

/// progress(fraction 0..1); may be empty.
using Progress = std::function<void(double)>;

/// Greedy centres, dense direct solve. Samples within 1e-6 of the box's diagonal of each other count as one, with their
/// mean value. With smoothing, a centre's value is drawn towards the mean of the samples around it, so noise averages
/// out; without, every centre's own sample is met exactly.
/// @pre    at least 4 samples, not all in one plane, finite.
/// @error  Degenerate, NotFinite, InvalidArgument, Limit (over 20,000 centres).
/// @cost   O(max_centres^3 + max_centres * #S).
[[nodiscard]] Result<Fit> fit(const Samples& samples, const FitOptions& options, const Progress& progress = {});

/// Direct summation in double: the oracle of every faster evaluator. out[i] = s(points[i]), mm.
void evaluate(const Model& model, std::span<const Vec3> points_patient, std::span<double> out);
/// grad s; finite everywhere (a centre's own kernel contributes 0 there).
void evaluateGradient(const Model& model, std::span<const Vec3> points_patient, std::span<Vec3> out);

/// The model as a callback; the model is copied into it. `lipschitz` is what the caller can vouch for.
[[nodiscard]] Field asField(const Model& model, double lipschitz);

}  // namespace spinaltap::rbf
