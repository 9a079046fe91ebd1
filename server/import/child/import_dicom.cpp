#include <algorithm>
#include <map>

#include "server/import/child/dicom_file.h"
#include "server/import/child/hu.h"
#include "server/import/child/import_kinds.h"
#include "server/import/child/label.h"
#include "server/import/child/stack.h"

namespace spinaltap::importer {

namespace {

using Headers = std::vector<ParsedHeader>;

Result<Headers> parseHeaders(const Input& input) {
  Headers headers;
  for (std::size_t i = 0; i < input.files.size(); ++i) {
    reportProgress("check", i, input.files.size(), input.files[i].name);
    auto header = parseHeader(input.files[i], i);
    if (!header) return tl::unexpected(header.error());
    headers.push_back(std::move(*header));
  }
  return headers;
}

Error notCt(const Identity& identity) {
  return {ErrorCode::Unsupported, identity.name + ": " + identity.what + ", not a CT image"};
}

/// Reports, plans and the like lie beside images on every disc; they are passed over when there are images.
Result<Headers> keepImages(Headers headers, std::vector<std::string>& notes) {
  Headers images;
  std::map<std::string, int> skipped;
  for (const ParsedHeader& header : headers) {
    if (header.identity.kind == ObjectKind::NoImage) {
      ++skipped[header.identity.what];
    } else {
      images.push_back(header);
    }
  }
  if (images.empty()) return tl::unexpected(notCt(headers.front().identity));
  for (const auto& [what, count] : skipped) notes.push_back("skipped: " + std::to_string(count) + " x " + what);
  return images;
}

struct SeriesGroup {
  std::string key;
  Headers headers;
};

std::string listed(const std::vector<SeriesGroup>& groups) {
  constexpr std::size_t kShown = 6;
  std::string text;
  for (std::size_t i = 0; i < std::min(groups.size(), kShown); ++i) {
    const Headers& headers = groups[i].headers;
    text += "; " + std::to_string(i + 1) + " = " + std::to_string(headers.size()) + " files from " +
            headers.front().identity.name;
    if (headers.front().identity.kind == ObjectKind::OtherImage) text += " (" + headers.front().identity.what + ")";
  }
  return groups.size() > kShown ? text + "; ..." : text;
}

/// Numbered in the order in which their first files come.
Result<Headers> chooseSeries(Headers headers, int wanted) {
  std::vector<SeriesGroup> groups;
  for (ParsedHeader& header : headers) {
    const auto same = [&](const SeriesGroup& group) { return group.key == header.identity.series; };
    auto it = std::find_if(groups.begin(), groups.end(), same);
    if (it == groups.end()) it = groups.insert(groups.end(), {header.identity.series, {}});
    it->headers.push_back(std::move(header));
  }
  if (wanted > static_cast<int>(groups.size())) {
    return fail(ErrorCode::NotFound, "there is no series " + std::to_string(wanted) + listed(groups));
  }
  if (wanted > 0) return std::move(groups[static_cast<std::size_t>(wanted - 1)].headers);
  if (groups.size() > 1) {
    return fail(ErrorCode::Unsupported, "mixed series: the folder holds " + std::to_string(groups.size()) +
                                            " of them, choose one by its number" + listed(groups));
  }
  return std::move(groups.front().headers);
}

Result<std::vector<Slice>> allSlices(const Headers& headers, std::uint64_t voxel_limit) {
  std::vector<Slice> slices;
  for (const ParsedHeader& header : headers) {
    const ObjectKind kind = header.identity.kind;
    if (kind != ObjectKind::CtImage && kind != ObjectKind::MultiFrameCt) return tl::unexpected(notCt(header.identity));
    auto some = slicesOf(header, voxel_limit);
    if (!some) return tl::unexpected(some.error());
    for (Slice& slice : *some) slices.push_back(std::move(slice));
    if (slices.size() > voxel_limit) return fail(ErrorCode::Limit, header.identity.name + ": too many frames");
  }
  return slices;
}

/// Decodes each file when its first slice is due and drops it after its last.
class PixelFeed {
 public:
  PixelFeed(Input& input, const std::vector<Slice>& slices, bool multi_frame)
      : input_(input), multi_frame_(multi_frame), left_(input.files.size()) {
    for (const Slice& slice : slices) ++left_[slice.file];
    frames_ = left_;
  }

  Result<std::vector<std::int16_t>> hu(const Slice& slice, std::size_t& padded) {
    InputFile& file = input_.files[slice.file];
    if (held_ != &file) {
      auto cells = decodePixels(file, slice.pixels, frames_[slice.file], multi_frame_);
      if (!cells) return tl::unexpected(cells.error());
      cells_ = std::move(*cells);
      held_ = &file;
    }
    const std::size_t size = cells_.size() / frames_[slice.file];
    auto values = toHu(std::span(cells_).subspan(static_cast<std::size_t>(slice.frame) * size, size), slice.pixels,
                       slice.name, padded);
    if (--left_[slice.file] == 0) file.bytes = std::string();
    return values;
  }

 private:
  Input& input_;
  bool multi_frame_;
  std::vector<std::size_t> left_, frames_;
  const InputFile* held_ = nullptr;
  std::vector<char> cells_;
};

Result<void> sendPixels(Input& input, const std::vector<Slice>& slices, const Stack& stack, bool multi_frame,
                        Output& output) {
  PixelFeed feed(input, slices, multi_frame);
  std::size_t padded = 0;
  for (std::size_t k = 0; k < stack.order.size(); ++k) {
    const Slice& slice = slices[stack.order[k]];
    reportProgress("decode", k, stack.order.size(), slice.name);
    const auto values = feed.hu(slice, padded);
    if (!values) return tl::unexpected(values.error());
    output.hu(*values);
  }
  if (padded > 0) output.note(std::to_string(padded) + " padding pixels were set to -1024 HU");
  return {};
}

void collectNotes(const Headers& headers, const std::vector<Slice>& slices, std::vector<std::string>& notes) {
  const auto lossy =
      std::count_if(headers.begin(), headers.end(), [](const ParsedHeader& h) { return h.identity.lossy; });
  if (lossy > 0) notes.push_back(std::to_string(lossy) + " files have lossy compression: their HU are approximate");
  if (slices.size() == 1) notes.push_back("a single slice: its thickness stands for the spacing");
}

}  // namespace

Result<void> importDicom(Input& input, const ImportRequest& request, Output& output) {
  std::vector<std::string> notes = input.notes;
  auto headers = parseHeaders(input);
  if (headers) headers = keepImages(std::move(*headers), notes);
  if (headers) headers = chooseSeries(std::move(*headers), request.series);
  if (!headers) return tl::unexpected(headers.error());
  const auto slices = allSlices(*headers, request.limits.voxels);
  if (!slices) return tl::unexpected(slices.error());
  const auto stack = arrangeStack(*slices, {request.allow_single_slice, request.limits.voxels});
  if (!stack) return tl::unexpected(stack.error());

  std::vector<std::uint8_t> inside;
  if (request.label) {
    reportProgress("label", 0, 1, input.label.front().name);
    auto label = loadLabel(input.label.front(), request.label->value, stack->grid, request.limits.voxels);
    if (!label) return tl::unexpected(label.error());
    inside = std::move(*label);
  }
  const bool frames = headers->front().identity.kind == ObjectKind::MultiFrameCt;
  collectNotes(*headers, *slices, notes);
  headers->clear();
  output.accepted(
      {frames ? SourceKind::DicomMultiFrame : SourceKind::DicomSlices, stack->grid, request.label.has_value()});
  if (auto sent = sendPixels(input, *slices, *stack, frames, output); !sent) return sent;
  output.label(inside);
  for (const std::string& note : notes) output.note(note);
  return {};
}

}  // namespace spinaltap::importer
