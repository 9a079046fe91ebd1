#include "core/recording/recording.h"

namespace spinaltap::recording {
namespace {

constexpr std::size_t kInputsPerProgress = 4096;

/// Walks along the checkpoints while the session steps.
class Comparison {
 public:
  explicit Comparison(const std::vector<Checkpoint>& checkpoints) : checkpoints_(checkpoints) {}

  /// A refused input changes neither cycle nor hash, so comparing at the cycle's first arrival is enough.
  void at(std::uint64_t cycle, std::uint64_t state_hash) {
    while (next_ < checkpoints_.size() && checkpoints_[next_].cycle <= cycle) {
      const Checkpoint& checkpoint = checkpoints_[next_++];
      const bool met = checkpoint.cycle == cycle && checkpoint.state_hash == state_hash;
      if (!met && !differs_) note(checkpoint);
    }
  }
  void finish(ReplayReport& report) {
    if (next_ < checkpoints_.size() && !differs_) note(checkpoints_[next_]);
    report.verified = !differs_ && !checkpoints_.empty();
    report.first_difference = first_difference_;
  }

 private:
  void note(const Checkpoint& checkpoint) {
    differs_ = true;
    first_difference_ = checkpoint.cycle;
  }
  const std::vector<Checkpoint>& checkpoints_;
  std::size_t next_ = 0;
  bool differs_ = false;
  std::uint64_t first_difference_ = 0;
};

}  // namespace

Result<ReplayReport> replay(const Recording& recording, const std::function<void(double)>& progress,
                            const Observer& each) {
  Result<session::Session> session = session::Session::create(recording.volume, recording.header.config);
  if (!session) return tl::unexpected(session.error());
  ReplayReport report;
  report.state_hash = session->stateHash();
  Comparison comparison(recording.checkpoints);
  comparison.at(0, report.state_hash);
  std::vector<std::uint32_t> removed;
  for (std::size_t i = 0; i < recording.inputs.size(); ++i) {
    removed.clear();
    const session::Output output = session->step(recording.inputs[i], [&](std::span<const std::uint32_t> some) {
      if (each) removed.insert(removed.end(), some.begin(), some.end());
    });
    if (each) each(recording.inputs[i], output, removed);
    report.cycles = output.cycle;
    report.state_hash = output.state_hash;
    comparison.at(output.cycle, output.state_hash);
    if (progress && i % kInputsPerProgress == 0) {
      progress(static_cast<double>(i) / static_cast<double>(recording.inputs.size()));
    }
  }
  comparison.finish(report);
  if (progress) progress(1.0);
  return report;
}

}  // namespace spinaltap::recording
