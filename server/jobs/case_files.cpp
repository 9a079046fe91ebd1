#include "server/jobs/case_files.h"

#include "core/volume/crop.h"
#include "core/wire/mesh_message.h"
#include "core/wire/point_volume_message.h"

namespace spinaltap::jobs {
namespace {

template <class T>
Result<T> load(store::Store& store, const store::BlobId& id, const std::string& missing,
               Result<T> (*decode)(std::span<const std::byte>)) {
  if (id.empty()) return fail(ErrorCode::NotFound, missing);
  const auto bytes = store.blobs().get(id);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode(*bytes);
}

}  // namespace

Result<volume::CtVolume> loadCt(store::Store& store, const store::Case& row) {
  return load(store, row.ct, "case " + row.id + " has no CT", decodeCt);
}

Result<volume::LabelVolume> loadLabel(store::Store& store, const store::Case& row) {
  return load(store, row.label_blob, "case " + row.id + " has no label yet: segment it first", decodeLabel);
}

Result<volume::CtVolume> loadRoi(store::Store& store, const store::Case& row) {
  return load(store, row.roi, "case " + row.id + " is not reconstructed yet", decodeCt);
}

Result<mesh::TriangleMesh> loadMesh(store::Store& store, const store::Case& row) {
  return load(store, row.mesh, "case " + row.id + " is not reconstructed yet", wire::decodeMesh);
}

Result<rbf::Model> loadModel(store::Store& store, const store::Case& row) {
  return load(store, row.model, "case " + row.id + " is not reconstructed yet", decodeModel);
}

Result<point_volume::PointVolume> loadPointVolume(store::Store& store, const store::Path& row) {
  return load(store, row.point_volume, "path " + row.id + " has no point volume", wire::decodePointVolume);
}

Result<Region> loadRegion(store::Store& store, const store::Case& row) {
  const auto label = loadLabel(store, row);
  if (!label) return tl::unexpected(label.error());
  const auto ct = loadCt(store, row);
  if (!ct) return tl::unexpected(ct.error());
  const auto box = volume::boundsOf(*label);
  if (!box) return tl::unexpected(box.error());
  const auto wide = volume::widened(*box, ct->grid, kRoiMargin_mm);
  auto ct_part = volume::cropTo(*ct, wide.low, wide.high);
  if (!ct_part) return tl::unexpected(ct_part.error());
  auto label_part = volume::cropTo(*label, wide.low, wide.high);
  if (!label_part) return tl::unexpected(label_part.error());
  return Region{std::move(*ct_part), std::move(*label_part)};
}

Result<void> checkLabelText(const std::string& text) {
  if (text.size() > 100) return fail(ErrorCode::InvalidArgument, "label: over 100 bytes");
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      return fail(ErrorCode::InvalidArgument, "label: holds a control character");
    }
  }
  return {};
}

}  // namespace spinaltap::jobs
