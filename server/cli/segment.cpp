
#include "server/cli/commands.h"
#include "server/jobs/segment_job.h"

namespace spinaltap::cli {
namespace {

Result<void> readVec3(const std::string& text, const char* option, Vec3& into) {
  if (text.empty()) return {};
  const auto value = parseVec3(text, option);
  if (!value) return tl::unexpected(value.error());
  into = *value;
  return {};
}

Result<jobs::SegmentJob> jobOf(const SegmentOptions& options) {
  jobs::SegmentJob job{options.case_id, {}};
  if (options.seed.empty()) return job;
  segment::GrowOptions grow;
  grow.threshold_hu = options.threshold_HU;
  grow.neck_mm = options.neck_mm;
  grow.closing_mm = options.closing_mm;
  if (const auto read = readVec3(options.seed, "--seed", grow.seed_patient); !read) return tl::unexpected(read.error());
  if (const auto read = readVec3(options.half_box, "--half-box", grow.half_box_mm); !read) {
    return tl::unexpected(read.error());
  }
  if (const auto read = readVec3(options.box_offset, "--box-offset", grow.box_offset_mm); !read) {
    return tl::unexpected(read.error());
  }
  job.grow = grow;
  return job;
}

}  // namespace

Result<Outcome> runSegment(const SegmentOptions& options, ProgressBar& bar) {
  const auto job = jobOf(options);
  if (!job) return tl::unexpected(job.error());
  auto store = openStore(options.data);
  if (!store) return tl::unexpected(store.error());
  auto figures = jobs::segmentCase(*store, *job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  return Outcome{std::move(*figures)};
}

}  // namespace spinaltap::cli
