#include <algorithm>
#include <string>
#include <utility>

#include "core/recording/recording.h"

namespace spinaltap::recording {
namespace {

constexpr std::size_t kInputsPerProgress = 4096;

/// Walks along the recording while the session steps.
class Comparison {
 public:
  explicit Comparison(const Recording& recording) : recording_(recording) {}

  void after(std::size_t inputs, const session::Output& output, std::span<const std::uint32_t> removed,
             const point_volume::PointVolume& volume) {
    if (recording_.version > 1) removed_.add(removed, output.cycle, volume);
    if (hashesCompare() && inputs <= recording_.checks.size() &&
        recording_.checks[inputs - 1] != static_cast<std::uint16_t>(output.state_hash)) {
      note(output.cycle);
    }
    while (next_ < recording_.checkpoints.size() && recording_.checkpoints[next_].inputs == inputs) {
      compare(recording_.checkpoints[next_++], output);
    }
  }
  void finish(ReplayReport& report) {
    if (next_ < recording_.checkpoints.size()) note(recording_.checkpoints[next_].cycle);
    report.verified = !differs_ && !recording_.checkpoints.empty();
    report.comparable = !differs_ || recording_.version > 1;
    if (!report.comparable) return;
    report.first_difference = first_difference_;
    report.discs = std::move(discs_);
  }

 private:
  void compare(const Checkpoint& checkpoint, const session::Output& output) {
    if (recording_.version > 1 && discs_.empty()) {
      discs_ = differingDiscs(removed_.take(), checkpoint.discs);
      if (!discs_.empty()) note(checkpoint.cycle);
    }
    const bool same_state = !hashesCompare() || checkpoint.state_hash == output.state_hash;
    if (checkpoint.cycle != output.cycle || !same_state) note(checkpoint.cycle);
  }
  /// Version 2 hashed another force.
  [[nodiscard]] bool hashesCompare() const { return recording_.version != 2; }
  void note(std::uint64_t cycle) {
    if (differs_) return;
    differs_ = true;
    first_difference_ = std::max<std::uint64_t>(cycle, 1);  // 0 says that there is none
  }

  const Recording& recording_;
  DiscSums removed_;
  std::size_t next_ = 0;
  bool differs_ = false;
  std::uint64_t first_difference_ = 0;
  std::vector<std::uint32_t> discs_;
};

/// 4-7, 12
std::string asRanges(const std::vector<std::uint32_t>& numbers) {
  std::string text;
  for (std::size_t begin = 0; begin < numbers.size();) {
    std::size_t end = begin + 1;
    while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1) ++end;
    if (begin > 0) text += ", ";
    text += std::to_string(numbers[begin]);
    if (end > begin + 1) text.append("-").append(std::to_string(numbers[end - 1]));
    begin = end;
  }
  return text;
}

}  // namespace

std::string describe(const ReplayReport& report) {
  if (report.verified) return "verified: " + std::to_string(report.cycles) + " cycles re-run, the same state";
  if (!report.comparable) {
    return "not verifiable: recorded before version 0.2, which hashed states otherwise; the inputs replay";
  }
  if (report.first_difference == 0) return "not verified: the recording has no state to compare with";
  const std::string where = report.discs.empty()       ? "in force or time, on no disc"
                            : report.discs.size() == 1 ? "on disc " + asRanges(report.discs)
                                                       : "on discs " + asRanges(report.discs);
  return "not verified: differs first at cycle " + std::to_string(report.first_difference) + ", " + where;
}

Result<ReplayReport> replay(const Recording& recording, const std::function<void(double)>& progress,
                            const Observer& each) {
  Result<session::Session> session = session::Session::create(recording.volume, recording.header.config);
  if (!session) return tl::unexpected(session.error());
  ReplayReport report;
  report.state_hash = session->stateHash();
  Comparison comparison(recording);
  std::vector<std::uint32_t> removed;
  for (std::size_t i = 0; i < recording.inputs.size(); ++i) {
    removed.clear();
    const session::Output output = session->step(recording.inputs[i], [&](std::span<const std::uint32_t> some) {
      removed.insert(removed.end(), some.begin(), some.end());
    });
    if (each) each(recording.inputs[i], output, removed);
    report.cycles = output.cycle;
    report.state_hash = output.state_hash;
    comparison.after(i + 1, output, removed, session->volume());
    if (progress && i % kInputsPerProgress == 0) {
      progress(static_cast<double>(i) / static_cast<double>(recording.inputs.size()));
    }
  }
  comparison.finish(report);
  if (progress) progress(1.0);
  return report;
}

}  // namespace spinaltap::recording
