#include "server/import/import.h"

#include <csignal>
#include <nlohmann/json.hpp>

#include "server/import/child_process.h"
#include "server/import/protocol.h"
#include "server/import/sanitized.h"

namespace spinaltap::importer {

namespace {

/// What the child is at, for the caller and to say on what a crash happened.
class ProgressReader {
 public:
  explicit ProgressReader(const ProgressCallback& sink) : sink_(sink) {}
  void operator()(const std::string& line) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (!json.is_object()) return;
    ImportProgress now;
    if (const auto it = json.find("stage"); it != json.end() && it->is_string())
      now.stage = oneLine(it->get<std::string>(), 32);
    if (const auto it = json.find("done"); it != json.end() && it->is_number_unsigned())
      now.done = it->get<std::uint64_t>();
    if (const auto it = json.find("total"); it != json.end() && it->is_number_unsigned())
      now.total = it->get<std::uint64_t>();
    if (const auto it = json.find("file"); it != json.end() && it->is_string())
      file_ = oneLine(it->get<std::string>(), 120);
    if (sink_) sink_(now);
  }
  [[nodiscard]] std::string file() const { return file_.empty() ? "the input" : file_; }

 private:
  const ProgressCallback& sink_;
  std::string file_;
};

Error errorOfEnd(const ChildEnd& end, const std::string& file, const ImportLimits& limits) {
  if (end.timed_out || end.signal == SIGXCPU) {
    const auto seconds = static_cast<double>(limits.wall_time.count()) / 1000.0;
    std::string text = std::to_string(seconds);
    text.resize(text.find('.') + 2);
    return {ErrorCode::Limit, "the importer stopped on " + file + ": it took longer than " + text + " s"};
  }
  // A parser that gives up aborts; only a sanitizer's finding exits, and no test may take that for a refusal.
  if (SPINALTAP_SANITIZED != 0 && end.exit_code != 0) {
    return {ErrorCode::Corrupt, "a sanitizer stopped the importer on " + file};
  }
  if (end.signal == SIGABRT || end.exit_code != 0) {
    return {ErrorCode::Corrupt, "the importer stopped on " + file + ": its parser gave up on a broken file"};
  }
  if (end.signal != 0) {
    return {ErrorCode::Corrupt,
            "the importer stopped on " + file + ": its parser crashed (signal " + std::to_string(end.signal) + ")"};
  }
  return {ErrorCode::Corrupt, "the importer stopped on " + file + " without an answer"};
}

Result<void> checkRequest(const ImportRequest& request) {
  constexpr std::size_t kLongestPath = 4000;
  if (request.from.empty()) return fail(ErrorCode::InvalidArgument, "no folder or file to import from");
  if (request.from.native().size() > kLongestPath) return fail(ErrorCode::InvalidArgument, "the path is too long");
  if (request.series < 0) return fail(ErrorCode::InvalidArgument, "the series number must be 1 or more");
  if (!request.label) return {};
  if (request.label->value <= 0) return fail(ErrorCode::InvalidArgument, "the label value must be 1 or more");
  if (request.label->file.empty()) return fail(ErrorCode::InvalidArgument, "no label file given");
  if (request.label->file.native().size() > kLongestPath) {
    return fail(ErrorCode::InvalidArgument, "the path of the label is too long");
  }
  return {};
}

}  // namespace

const char* nameOf(SourceKind kind) {
  switch (kind) {
    case SourceKind::DicomSlices:
      return "dicom-slices";
    case SourceKind::DicomMultiFrame:
      return "dicom-multi-frame";
    case SourceKind::Nifti:
      return "nifti";
  }
  return "unknown";
}

Result<ImportedVolume> importVolume(const ImportRequest& request, const ProgressCallback& progress) {
  if (auto good = checkRequest(request); !good) return tl::unexpected(good.error());
  FrameReader frames(request.limits, request.label.has_value());
  Result<void> fed;
  ProgressReader state(progress);
  ChildStreams streams;
  streams.output = [&](std::span<const std::byte> bytes) {
    fed = frames.feed(bytes);
    return fed.has_value();
  };
  streams.progress_line = [&](const std::string& line) { state(line); };

  const std::filesystem::path program = request.program.empty() ? defaultChildProgram() : request.program;
  const auto end = runChild(program, {}, encodeRequest(request), request.limits.wall_time, streams);
  if (!end) return tl::unexpected(end.error());
  if (!fed) return tl::unexpected(fed.error());
  if (frames.refused()) return tl::unexpected(frames.refusal());
  if (!frames.ended()) return tl::unexpected(errorOfEnd(*end, state.file(), request.limits));
  return frames.take();
}

}  // namespace spinaltap::importer
