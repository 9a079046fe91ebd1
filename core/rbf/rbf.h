// core/rbf/rbf.h - implicit surface through signed-distance samples.
// After: Carr et al., "Reconstruction and Representation of 3D Objects with Radial Basis Functions", SIGGRAPH 2001.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/field.h"
#include "core/base/result.h"

namespace spinaltap::rbf {

/// #S positions (mm, patient frame) and #S signed distances (mm, negative inside bone). Any other unit does as well, as
/// long as it is one for positions, distances, tolerances and smoothing: everything is scaled by the set's own size.
struct Samples {
  std::vector<Vec3> positions;
  std::vector<double> distances_mm;
};

/// s(x) = c0 + c . (x - centroid) + sum_i w_i |x - c_i|, the weights orthogonal to linear polynomials. Beyond
/// `radius_mm` from the centroid nothing was sampled, and bone ends somewhere: there s is at least the distance beyond.
/// Centres are kept relative to `centroid_patient`, so that a far origin costs no digits.
struct Model {
  Vec3 centroid_patient;
  double radius_mm = 0;         ///< of a ball around the centroid that holds every sample; 0: no such bound
  std::vector<Vec3> centres;    ///< #C, relative to the centroid
  std::vector<double> weights;  ///< #C
  double constant = 0;          ///< c0
  Vec3 linear;                  ///< c
};

/// A smoothing to be chosen by fit(): so large that the residual is about the samples' noise, which is estimated.
inline constexpr double kAutoSmoothing = -1;

struct FitOptions {
  double tolerance_mm =
      0.01;              ///< every sample is met this closely; with smoothing, every equation of the smooth system
  double smoothing = 0;  ///< ridge on the kernel's diagonal (mm); 0 interpolates, kAutoSmoothing chooses
  double reduce_mm = 0;  ///< 0: every sample is a centre; else the fewest found that stay this close to that fit
  unsigned threads = 0;  ///< 0: all
};

struct FitReport {
  std::size_t samples = 0, merged = 0, centres = 0;  ///< merged: samples that lay on another and were averaged with it
  int rounds = 0;                                    ///< products with the whole matrix; 0 when it was solved directly
  double noise_mm = 0;                               ///< estimated, when smoothing was to be chosen
  double smoothing = 0;                              ///< the ridge used
  double residual_max_mm = 0, residual_rms_mm = 0;   ///< s minus the samples' distances, by direct summation
  std::size_t residual_samples = 0;  ///< how many samples those are over: all, up to kDirectPairs of sample and centre
  double reduction_max_mm = 0;       ///< the reduced fit minus the full one, over all samples
  double sum_abs_weights = 0;        ///< large when the set is badly conditioned
};

/// Direct residuals of a fit take at most so many pairs (some seconds); of larger fits, an even choice of samples.
inline constexpr std::uint64_t kDirectPairs = 20'000'000'000;

struct Fit {
  Model model;
  FitReport report;
};

/// progress(fraction 0..1); may be empty.
using Progress = std::function<void(double)>;

/// One global fit to all samples. Samples closer than a ten-thousandth of their usual spacing count as one, with their
/// mean value. Noise is taken out first (smoothing), centres afterwards (reduction), so that reduction does not pick
/// the noise. The same bits from any number of threads.
/// @pre    at least 4 samples, not all in one plane, finite.
/// @error  Degenerate, NotFinite, InvalidArgument, NotConverged (tolerance below what double can give; the message has
///         the residual that was reached).
/// @cost   about O(#S log #S) time; 4 kB of memory a sample. See tests/bench/bench_rbf.cpp.
[[nodiscard]] Result<Fit> fit(const Samples& samples, const FitOptions& options, const Progress& progress = {});

/// Direct summation in double: the oracle of every faster evaluator. out[i] = s(points[i]), mm.
void evaluate(const Model& model, std::span<const Vec3> points_patient, std::span<double> out, unsigned threads = 0);
/// grad s; finite everywhere (a centre's own kernel contributes 0 there).
void evaluateGradient(const Model& model, std::span<const Vec3> points_patient, std::span<Vec3> out,
                      unsigned threads = 0);

/// s and its gradient at many points at once, by fast summation where that pays.
class Evaluator {
 public:
  /// Values within `tolerance_mm` of the oracle's: the orders of the sums follow from the weights, and are made finer
  /// until they agree with it to a fifth of that at some hundred places, most of them beside the heaviest weights.
  /// Checked, not proved. Below what fast sums can give, everything is direct.
  /// @param model copied. @pre tolerance_mm > 0.
  Evaluator(Model model, double tolerance_mm, unsigned threads = 0);

  /// @cost a few ms and O(#points + #centres); direct when #points * #centres is below some millions. Points farther
  /// from the centroid than four radii are always direct.
  void values(std::span<const Vec3> points_patient, std::span<double> out) const;
  void gradients(std::span<const Vec3> points_patient, std::span<Vec3> out) const;

  [[nodiscard]] const Model& model() const { return model_; }

 private:
  struct Prepared;  ///< the centres' half of the sums

  template <class Use, class Direct>
  void split(std::span<const Vec3> points_patient, const Use& use, const Direct& direct) const;
  /// Where the bound beyond the ball is larger than the sums, the gradient points away from the centroid.
  void pointAwayBeyond(std::span<const Vec3> at, std::span<const std::size_t> near, std::span<const Vec3> points,
                       std::span<Vec3> out) const;

  Model model_;
  double tolerance_;
  unsigned threads_;
  double error_ = 0;                          ///< what sums are asked to stay within
  std::shared_ptr<const Prepared> prepared_;  ///< none: direct only
};

/// The model as a callback; it is copied. `lipschitz` is what the caller can vouch for (at least 1 is assumed).
/// @param tolerance_mm 0: direct summation; else an Evaluator of that tolerance.
[[nodiscard]] Field asField(const Model& model, double lipschitz, double tolerance_mm = 0);

}  // namespace spinaltap::rbf
