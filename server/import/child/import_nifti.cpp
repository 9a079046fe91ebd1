#include <algorithm>

#include "server/import/child/import_kinds.h"
#include "server/import/child/label.h"
#include "server/import/child/nifti.h"

namespace spinaltap::importer {

namespace {

Result<void> sendVoxels(ByteSource& source, const NiftiHeader& header, bool reversed, const std::string& name,
                        Output& output) {
  std::vector<std::int16_t> slice;
  const std::size_t in_slice = static_cast<std::size_t>(header.dims[0]) * static_cast<std::size_t>(header.dims[1]);
  std::size_t done = 0;
  const auto row = [&](std::span<const double> voxels) -> Result<void> {
    const std::size_t begin = slice.size();
    for (const double v : voxels) {
      const auto hu = voxelToHu(v, name);
      if (!hu) return tl::unexpected(hu.error());
      slice.push_back(*hu);
    }
    if (reversed) std::reverse(slice.begin() + static_cast<std::ptrdiff_t>(begin), slice.end());
    if (slice.size() < in_slice) return {};
    reportProgress("decode", ++done, static_cast<std::size_t>(header.dims[2]), name);
    output.hu(slice);
    slice.clear();
    return {};
  };
  return readNiftiRows(source, header, name, row);
}

}  // namespace

Result<void> importNifti(const Input& input, const ImportRequest& request, Output& output) {
  const InputFile& file = input.files.front();
  reportProgress("check", 0, 1, file.name);
  ByteSource source(file.bytes);
  const auto header = readNiftiHeader(source, file.name, request.limits.voxels);
  if (!header) return tl::unexpected(header.error());
  if (*std::min_element(header->dims.begin(), header->dims.end()) == 1 && !request.allow_single_slice) {
    return fail(ErrorCode::Unsupported, file.name + ": a single slice is not a volume");
  }
  const NiftiGrid placed = gridOf(*header);
  std::vector<std::uint8_t> inside;
  if (request.label) {
    reportProgress("label", 0, 1, input.label.front().name);
    auto label = loadLabel(input.label.front(), request.label->value, placed.grid, request.limits.voxels);
    if (!label) return tl::unexpected(label.error());
    inside = std::move(*label);
  }
  output.accepted({SourceKind::Nifti, placed.grid, request.label.has_value()});
  if (auto sent = sendVoxels(source, *header, placed.reversed, file.name, output); !sent) return sent;
  output.label(inside);
  for (const std::string& note : header->notes) output.note(note);
  return {};
}

}  // namespace spinaltap::importer
