#include "core/phantom/ct.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/random.h"

namespace spinaltap::phantom {
namespace {

using Image = std::vector<float>;  // one slice, i fastest

/// A thin layer of bone: which part of each pixel it fills, and the sum of its HU over that part.
struct Layer {
  Image covered, hu;
};

constexpr int kBlock = 8;          // pixels; whole blocks far from bone are skipped
constexpr int kSoftStep = 2;       // soft tissue is evaluated every so many pixels and slices
constexpr double kNearEdge = 0.4;  // mm of signed distance within which pixels are supersampled

Result<void> checkOptions(const CtOptions& o) {
  for (int n : o.dims) {
    if (n < 1) return fail(ErrorCode::InvalidArgument, "phantom CT: dims must be positive");
  }
  for (double length : {o.pixel_mm, o.spacing_mm, o.thickness_mm}) {
    if (!(length > 0) || !std::isfinite(length)) {
      return fail(ErrorCode::InvalidArgument, "phantom CT: pixel, spacing and thickness must be positive");
    }
  }
  for (double size : {o.psf_fwhm_mm, o.noise_hu}) {
    if (!(size >= 0) || !std::isfinite(size)) {
      return fail(ErrorCode::InvalidArgument, "phantom CT: point spread and noise must not be negative");
    }
  }
  return {};
}

/// The box profile of a slice as weights of thin layers `step` apart, centred on the slice.
std::vector<float> sliceProfile(double thickness, double step) {
  const int reach = static_cast<int>(std::ceil(0.5 * thickness / step - 0.5));
  std::vector<float> weights;
  for (int n = -reach; n <= reach; ++n) {
    const double low = std::max((n - 0.5) * step, -0.5 * thickness), high = std::min((n + 0.5) * step, 0.5 * thickness);
    weights.push_back(static_cast<float>(std::max(high - low, 0.0) / thickness));
  }
  return weights;
}

class Sampler {
 public:
  Sampler(const Phantom& phantom, const volume::Grid& grid) : phantom_(phantom), nx_(grid.dims[0]), ny_(grid.dims[1]) {
    const Frame& frame = phantom.frame();
    origin_ = frame.toLocal(grid.origin_patient);
    di_ = frame.directionToLocal(grid.direction.col_x) * grid.spacing_mm.x;
    dj_ = frame.directionToLocal(grid.direction.col_y) * grid.spacing_mm.y;
    dk_ = frame.directionToLocal(grid.direction.col_z) * grid.spacing_mm.z;
  }

  /// Soft tissue at slice k, between samples on a coarser grid: it has no detail that would need more.
  void softSlice(int k, Image& out) {
    const int below = k / kSoftStep * kSoftStep;
    const auto part = static_cast<float>(k - below) / kSoftStep;
    softPlane(below, low_plane_, low_k_);
    softPlane(below + kSoftStep, high_plane_, high_k_);
    const int cx = coarse(nx_);
    for (int j = 0; j < ny_; ++j) {
      for (int i = 0; i < nx_; ++i) {
        const std::size_t at = static_cast<std::size_t>(j / kSoftStep) * cx + static_cast<std::size_t>(i / kSoftStep);
        const float fx = static_cast<float>(i % kSoftStep) / kSoftStep,
                    fy = static_cast<float>(j % kSoftStep) / kSoftStep;
        const auto flat = [&](const Image& plane) {
          const float a = plane[at] + (plane[at + 1] - plane[at]) * fx;
          const float b = plane[at + cx] + (plane[at + cx + 1] - plane[at + cx]) * fx;
          return a + (b - a) * fy;
        };
        const float low = flat(low_plane_);
        out[static_cast<std::size_t>(j) * nx_ + static_cast<std::size_t>(i)] =
            part > 0 ? low + (flat(high_plane_) - low) * part : low;
      }
    }
  }

  /// Bone in the layer at slice coordinate k (may lie between slices), `step` slices thick.
  void boneLayer(double k, double step, Layer& out) {
    std::fill(out.covered.begin(), out.covered.end(), 0.0f);
    std::fill(out.hu.begin(), out.hu.end(), 0.0f);
    const double half = 0.5 * kBlock;
    const double reach = Phantom::kLipschitz * norm(di_ * half + dj_ * half + dk_ * (0.5 * step));
    for (int j = 0; j < ny_; j += kBlock) {
      for (int i = 0; i < nx_; i += kBlock) {
        const Vec3 centre = at(i + half - 0.5, j + half - 0.5, k);
        // Far from the whole bone the implicit need not be asked.
        if (!nearBone(centre, reach)) continue;
        if (boneDistance(phantom_.anatomy(), centre) <= reach) boneBlock(i, j, k, step, out);
      }
    }
  }

 private:
  static int coarse(int n) { return (n - 1) / kSoftStep + 2; }

  [[nodiscard]] Vec3 at(double i, double j, double k) const { return origin_ + di_ * i + dj_ * j + dk_ * k; }

  [[nodiscard]] bool nearBone(const Vec3& p, double margin) const {
    const Anatomy& an = phantom_.anatomy();
    return std::fabs(p.x) < an.transverse_span + 2 + margin && p.y > -an.rim_half_depth - 5 - margin &&
           p.y < an.spinous_tip_y + 3 + margin && p.z > -31 - margin && p.z < 22 + margin;
  }

  void softPlane(int k, Image& plane, int& held) {
    if (held == k) return;
    if (&plane == &low_plane_ && high_k_ == k) {
      std::swap(low_plane_, high_plane_);
      std::swap(low_k_, high_k_);
      return;
    }
    held = k;
    plane.resize(static_cast<std::size_t>(coarse(nx_)) * coarse(ny_));
    std::size_t n = 0;
    for (int j = 0; j < coarse(ny_); ++j) {
      for (int i = 0; i < coarse(nx_); ++i) {
        const Vec3 p = at(i * kSoftStep, j * kSoftStep, k);
        plane[n++] = static_cast<float>(phantom_.tissue().softHu(phantom_.anatomy(), p));
      }
    }
  }

  void boneBlock(int i0, int j0, double k, double step, Layer& out) {
    for (int j = j0; j < std::min(j0 + kBlock, ny_); ++j) {
      for (int i = i0; i < std::min(i0 + kBlock, nx_); ++i) bonePixel(i, j, k, step, out);
    }
  }

  /// One sample well inside, four where an edge may cross: spread over the pixel and, each at its own height, over the
  /// layer, so that flat endplates do not come out in terraces.
  void bonePixel(int i, int j, double k, double step, Layer& out) {
    const std::size_t n = static_cast<std::size_t>(j) * nx_ + static_cast<std::size_t>(i);
    const Vec3 p = at(i, j, k);
    const double s = boneDistance(phantom_.anatomy(), p);
    if (s > kNearEdge) return;
    if (s < -kNearEdge && std::fabs(s + phantom_.tissue().shellThickness(p)) > kNearEdge) {
      out.covered[n] = 1;
      out.hu[n] = static_cast<float>(phantom_.tissue().boneHu(phantom_.anatomy(), p, -s));
      return;
    }
    constexpr double kHeights[4] = {-0.375, 0.125, 0.375, -0.125};
    for (int quarter = 0; quarter < 4; ++quarter) {
      const Vec3 q =
          at(i + (quarter & 1 ? 0.25 : -0.25), j + (quarter & 2 ? 0.25 : -0.25), k + kHeights[quarter] * step);
      const double sq = boneDistance(phantom_.anatomy(), q);
      if (sq >= 0) continue;
      out.covered[n] += 0.25f;
      out.hu[n] += 0.25f * static_cast<float>(phantom_.tissue().boneHu(phantom_.anatomy(), q, -sq));
    }
  }

  const Phantom& phantom_;
  int nx_, ny_;
  Vec3 origin_, di_, dj_, dk_;  // the grid in the vertebra's frame
  Image low_plane_, high_plane_;
  int low_k_ = -1, high_k_ = -1;
};

/// Slices, before point spread and noise. Thin layers, two or more a slice, are made once each and shared by the slices
/// that they lie in.
class Stack {
 public:
  Stack(const Phantom& phantom, const volume::Grid& grid, const CtOptions& options)
      : sampler_(phantom, grid),
        layers_per_slice_(std::max(2, static_cast<int>(std::ceil(options.spacing_mm / 0.3)))),
        profile_(sliceProfile(options.thickness_mm, options.spacing_mm / layers_per_slice_)),
        reach_(static_cast<int>(profile_.size()) / 2),
        next_(-reach_) {
    const std::size_t pixels = static_cast<std::size_t>(options.dims[0]) * static_cast<std::size_t>(options.dims[1]);
    ring_.assign(profile_.size(), Layer{Image(pixels), Image(pixels)});
    bone_.resize(pixels);
    soft_part_.resize(pixels);
  }

  /// @pre  slices are asked for in order.
  void slice(int k, Image& out) {
    const int middle = k * layers_per_slice_;
    for (next_ = std::max(next_, middle - reach_); next_ <= middle + reach_; ++next_) {
      sampler_.boneLayer(static_cast<double>(next_) / layers_per_slice_, 1.0 / layers_per_slice_, held(next_));
    }
    std::fill(bone_.begin(), bone_.end(), 0.0f);
    std::fill(soft_part_.begin(), soft_part_.end(), 1.0f);
    for (int n = -reach_; n <= reach_; ++n) add(held(middle + n), profile_[static_cast<std::size_t>(n + reach_)]);
    sampler_.softSlice(k, out);
    for (std::size_t p = 0; p < out.size(); ++p) out[p] = out[p] * soft_part_[p] + bone_[p];
  }

 private:
  Layer& held(int layer) { return ring_[static_cast<std::size_t>(layer + reach_) % ring_.size()]; }

  void add(const Layer& layer, float weight) {
    for (std::size_t p = 0; p < bone_.size(); ++p) {
      bone_[p] += weight * layer.hu[p];
      soft_part_[p] -= weight * layer.covered[p];
    }
  }

  Sampler sampler_;
  int layers_per_slice_;
  std::vector<float> profile_;
  int reach_, next_;  // half the profile's layers; the first layer not yet made
  std::vector<Layer> ring_;
  Image bone_, soft_part_;
};

/// [w, 1 - 2w, w] along rows and then columns; edges repeat.
void smear(Image& image, int nx, int ny, float w, Image& scratch) {
  scratch = image;
  for (int j = 0; j < ny; ++j) {
    const float* row = &image[static_cast<std::size_t>(j) * nx];
    float* to = &scratch[static_cast<std::size_t>(j) * nx];
    for (int i = 1; i + 1 < nx; ++i) to[i] = row[i] + w * (row[i - 1] - 2 * row[i] + row[i + 1]);
  }
  image = scratch;
  for (int j = 1; j + 1 < ny; ++j) {
    const float* row = &scratch[static_cast<std::size_t>(j) * nx];
    float* to = &image[static_cast<std::size_t>(j) * nx];
    for (int i = 0; i < nx; ++i) to[i] = row[i] + w * (row[i - nx] - 2 * row[i] + row[i + nx]);
  }
}

/// Two passes of three taps each have the variance of the Gaussian: sigma^2 = 2 passes * 2w pixels^2.
void spread(Image& image, const CtOptions& options, Image& scratch) {
  const double sigma = options.psf_fwhm_mm / 2.354820045 / options.pixel_mm;
  const auto w = static_cast<float>(std::min(0.25 * sigma * sigma, 1.0 / 3.0));
  if (w <= 0) return;
  smear(image, options.dims[0], options.dims[1], w, scratch);
  smear(image, options.dims[0], options.dims[1], w, scratch);
}

/// White noise smoothed by [1 2 1] / 4 both ways, whose standard deviation is 6/16 of the white one's.
void addNoise(Image& image, const CtOptions& options, std::uint64_t phantom_seed, int k, Image& noise, Image& scratch) {
  if (options.noise_hu <= 0) return;
  Random random(combine(combine(options.seed, phantom_seed), static_cast<std::uint64_t>(k)));
  const double white = options.noise_hu * 16.0 / 6.0;
  for (float& value : noise) value = static_cast<float>(white * random.gaussian());
  smear(noise, options.dims[0], options.dims[1], 0.25f, scratch);
  for (std::size_t n = 0; n < image.size(); ++n) image[n] += noise[n];
}

std::int16_t stored(float hu) {
  return static_cast<std::int16_t>(std::floor(std::clamp(hu, -1024.0f, 3071.0f) + 0.5f));
}

}  // namespace

CtOptions CtOptions::coarser(double factor) {
  CtOptions options;
  for (int& n : options.dims) n = static_cast<int>(std::ceil(n / factor));
  options.pixel_mm *= factor;
  options.spacing_mm *= factor;
  return options;
}

volume::Grid ctGrid(const Phantom& phantom, const CtOptions& options) {
  volume::Grid grid;
  grid.dims = options.dims;
  grid.spacing_mm = {options.pixel_mm, options.pixel_mm, options.spacing_mm};
  // The arch reaches farthest up and down; the skin of the back is in view.
  const Vec3 middle = phantom.frame().toPatient({0, 30, -4.1});
  grid.origin_patient =
      middle - Vec3{0.5 * (options.dims[0] - 1) * options.pixel_mm, 0.5 * (options.dims[1] - 1) * options.pixel_mm,
                    0.5 * (options.dims[2] - 1) * options.spacing_mm};
  return grid;
}

Result<volume::CtVolume> sampleCt(const Phantom& phantom, const CtOptions& options, const Progress& progress) {
  if (auto ok = checkOptions(options); !ok) return tl::unexpected(ok.error());
  volume::CtVolume ct;
  ct.grid = ctGrid(phantom, options);
  if (auto ok = volume::checkGrid(ct.grid); !ok) return tl::unexpected(ok.error());
  ct.hu.resize(ct.grid.voxels());

  Stack stack(phantom, ct.grid, options);
  const std::size_t pixels = static_cast<std::size_t>(options.dims[0]) * static_cast<std::size_t>(options.dims[1]);
  Image image(pixels), noise(pixels), scratch(pixels);
  for (int k = 0; k < options.dims[2]; ++k) {
    stack.slice(k, image);
    spread(image, options, scratch);
    addNoise(image, options, phantom.options().seed, k, noise, scratch);
    std::transform(image.begin(), image.end(),
                   ct.hu.begin() + static_cast<std::ptrdiff_t>(pixels * static_cast<std::size_t>(k)), stored);
    if (progress) progress(static_cast<double>(k + 1) / options.dims[2]);
  }
  return ct;
}

volume::LabelVolume truthLabel(const Phantom& phantom, const volume::Grid& grid) {
  volume::LabelVolume label;
  label.grid = grid;
  label.inside.assign(grid.voxels(), 0);
  const double row = Phantom::kLipschitz * grid.spacing_mm.x;
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      for (int i = 0; i < grid.dims[0];) {
        const double s = phantom.signedDistance(
            grid.toPatient({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)}));
        // As many voxels as the bound allows have the same sign.
        const int run = 1 + static_cast<int>(std::min(std::fabs(s) / row * 0.999, static_cast<double>(grid.dims[0])));
        const int end = std::min(i + run, grid.dims[0]);
        if (s < 0) std::fill_n(label.inside.begin() + static_cast<std::ptrdiff_t>(grid.index(i, j, k)), end - i, 1);
        i = end;
      }
    }
  }
  return label;
}

}  // namespace spinaltap::phantom
