#include "server/dicom_out/phantom_series.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/base/hash.h"
#include "server/dicom_out/dicom_writer.h"

namespace spinaltap::dicom_out {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json toJson(const Vec3& v) { return Json::array({v.x, v.y, v.z}); }
Json toJson(const Mat3& m) { return Json::array({toJson(m.col_x), toJson(m.col_y), toJson(m.col_z)}); }

Json toJson(const phantom::PediclePath& path) {
  return {{"entry_patient", toJson(path.entry_patient)},
          {"target_patient", toJson(path.target_patient)},
          {"isthmus_patient", toJson(path.isthmus_patient)},
          {"width_mm", path.width_mm},
          {"height_mm", path.height_mm}};
}

/// Different options must never share a UID.
std::uint64_t uidSeed(const PhantomSeriesOptions& o) {
  std::uint64_t hash = combine(o.phantom.seed, o.phantom.osteoporotic ? 1 : 0);
  for (const int n : o.ct.dims) hash = combine(hash, static_cast<std::uint64_t>(n));
  for (const double v : {o.ct.pixel_mm, o.ct.spacing_mm, o.ct.thickness_mm, o.ct.psf_fwhm_mm, o.ct.noise_hu}) {
    hash = combine(hash, bitsOf(v));
  }
  return combine(hash, o.ct.seed);
}

SeriesIdentity identityOf(const PhantomSeriesOptions& o) {
  SeriesIdentity identity;
  identity.uid_seed = uidSeed(o);
  identity.patient_name = "Phantom^L3";
  identity.patient_id = "PHANTOM-" + std::to_string(o.phantom.seed);
  identity.description = o.phantom.osteoporotic ? "Phantom L3, osteoporotic" : "Phantom L3";
  identity.slice_thickness_mm = o.ct.thickness_mm;
  return identity;
}

std::string sliceName(int k) {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "slice-%03d.dcm", k);
  return name.data();
}

/// Files are made in a folder of their own inside `out_dir` and moved up together; whatever is left when this goes
/// away without commit() is removed again.
class Staging {
 public:
  static Result<Staging> open(const fs::path& out_dir) {
    std::error_code error;
    Staging staging;
    staging.out_ = out_dir;
    for (fs::path folder = fs::absolute(out_dir, error); !fs::exists(folder, error); folder = folder.parent_path()) {
      staging.made_.push_back(folder);
    }
    fs::create_directories(out_dir, error);
    if (error) return fail(ErrorCode::Io, "phantom: cannot make the output folder: " + error.message());
    const bool empty = fs::is_empty(out_dir, error);
    if (error) return fail(ErrorCode::Io, "phantom: cannot read the output folder: " + error.message());
    if (!empty) return fail(ErrorCode::InvalidArgument, "phantom: the output folder is not empty");
    fs::create_directory(staging.folder(), error);
    if (error) return fail(ErrorCode::Io, "phantom: cannot write into the output folder: " + error.message());
    staging.open_ = true;
    return staging;
  }
  Staging(Staging&& other) noexcept { *this = std::move(other); }
  Staging& operator=(Staging&& other) noexcept {
    std::swap(out_, other.out_);
    std::swap(names_, other.names_);
    std::swap(made_, other.made_);
    std::swap(open_, other.open_);
    return *this;
  }
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  ~Staging() {
    std::error_code ignored;
    if (open_) fs::remove_all(folder(), ignored);
    for (const std::string& name : names_) fs::remove(out_ / name, ignored);
    for (const fs::path& folder : made_) fs::remove(folder, ignored);
  }

  Result<void> write(const std::string& name, const char* data, std::size_t size) {
    std::ofstream file(folder() / name, std::ios::binary);
    file.write(data, static_cast<std::streamsize>(size));
    file.close();
    if (!file) return fail(ErrorCode::Io, "phantom: cannot write " + name);
    names_.push_back(name);
    return {};
  }

  Result<void> commit() {
    std::error_code error;
    for (const std::string& name : names_) {
      fs::rename(folder() / name, out_ / name, error);
      if (error) return fail(ErrorCode::Io, "phantom: cannot rename " + name + ": " + error.message());
    }
    fs::remove(folder(), error);
    open_ = false;
    names_.clear();
    made_.clear();
    return {};
  }

 private:
  Staging() = default;
  [[nodiscard]] fs::path folder() const { return out_ / ".partial"; }

  fs::path out_;
  std::vector<std::string> names_;
  std::vector<fs::path> made_;  // folders that were not there before, innermost first
  bool open_ = false;
};

PhantomSeriesSummary summaryOf(const phantom::Phantom& phantom, const volume::Grid& grid) {
  PhantomSeriesSummary summary;
  summary.grid = grid;
  summary.slices = grid.dims[2];
  summary.seed_point_patient = phantom.seedPoint();
  summary.bounds = phantom.bounds();
  summary.left = phantom.pedicle(phantom::Side::Left);
  summary.right = phantom.pedicle(phantom::Side::Right);
  const volume::LabelVolume label = phantom::truthLabel(phantom, grid);
  const auto inside = std::count(label.inside.begin(), label.inside.end(), 1);
  summary.bone_mm3 = static_cast<double>(inside) * grid.spacing_mm.x * grid.spacing_mm.y * grid.spacing_mm.z;
  return summary;
}

}  // namespace

std::string truthJson(const PhantomSeriesOptions& options) {
  const auto phantom = phantom::Phantom::make(options.phantom);
  const volume::Grid grid = phantom::ctGrid(phantom, options.ct);
  const phantom::CtOptions& ct = options.ct;
  const phantom::Bounds bounds = phantom.bounds();
  const Json truth{
      {"schema", "spinaltap-phantom-truth-1"},
      {"seed", options.phantom.seed},
      {"osteoporotic", options.phantom.osteoporotic},
      {"ct",
       {{"dims", ct.dims},
        {"pixel_mm", ct.pixel_mm},
        {"spacing_mm", ct.spacing_mm},
        {"thickness_mm", ct.thickness_mm},
        {"psf_fwhm_mm", ct.psf_fwhm_mm},
        {"noise_hu", ct.noise_hu},
        {"seed", ct.seed}}},
      {"grid", {{"origin_patient", toJson(grid.origin_patient)}, {"direction", toJson(grid.direction)}}},
      {"frame", {{"origin_patient", toJson(phantom.frame().origin_patient)}, {"axes", toJson(phantom.frame().axes)}}},
      {"seed_point_patient", toJson(phantom.seedPoint())},
      {"bounds_patient", {{"low", toJson(bounds.low_patient)}, {"high", toJson(bounds.high_patient)}}},
      {"pedicles",
       {{"left", toJson(phantom.pedicle(phantom::Side::Left))},
        {"right", toJson(phantom.pedicle(phantom::Side::Right))}}}};
  return truth.dump(2) + "\n";
}

Result<PhantomSeriesSummary> writePhantomSeries(const fs::path& out_dir, const PhantomSeriesOptions& options,
                                                const Progress& progress) {
  constexpr double kSampling = 0.9;  // of the whole time
  const auto report = [&progress](double part) {
    if (progress) progress(part);
  };
  auto staging = Staging::open(out_dir);
  if (!staging) return tl::unexpected(staging.error());
  const auto phantom = phantom::Phantom::make(options.phantom);
  const auto ct = phantom::sampleCt(phantom, options.ct, [&](double part) { report(kSampling * part); });
  if (!ct) return tl::unexpected(ct.error());
  const SeriesIdentity identity = identityOf(options);
  for (int k = 0; k < ct->grid.dims[2]; ++k) {
    const std::vector<std::uint8_t> file = sliceFile(*ct, k, identity);
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes to the stream's char
    auto ok = staging->write(sliceName(k), reinterpret_cast<const char*>(file.data()), file.size());
    if (!ok) return tl::unexpected(ok.error());
    report(kSampling + (1.0 - kSampling) * (k + 1) / ct->grid.dims[2]);
  }
  const std::string truth = truthJson(options);
  if (auto ok = staging->write("truth.json", truth.data(), truth.size()); !ok) return tl::unexpected(ok.error());
  if (auto ok = staging->commit(); !ok) return tl::unexpected(ok.error());
  return summaryOf(phantom, ct->grid);
}

}  // namespace spinaltap::dicom_out
