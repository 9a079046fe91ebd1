#include "server/ws/loop_metrics.h"

#include <cstdio>

namespace spinaltap::ws {
namespace {

std::string number(double v) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.9g", v);
  return text.data();
}

void head(std::string& out, const std::string& name, const char* type, const char* help) {
  out += "# HELP " + name + " " + help + "\n# TYPE " + name + " " + type + "\n";
}

using Loops = std::span<const LoopMetrics* const>;

void histogram(std::string& out, Loops loops, const std::string& name, const char* help,
               Histogram LoopMetrics::* which) {
  head(out, name, "histogram", help);
  std::uint64_t below = 0;
  double sum_s = 0;
  for (std::size_t i = 0; i <= Histogram::kBounds_s.size(); ++i) {
    for (const LoopMetrics* loop : loops) below += (loop->*which).count(i);
    const bool last = i == Histogram::kBounds_s.size();
    out += name + "_bucket{le=\"" + (last ? "+Inf" : number(Histogram::kBounds_s[i])) + "\"} " + std::to_string(below) +
           "\n";
  }
  for (const LoopMetrics* loop : loops) sum_s += (loop->*which).sum_s();
  out += name + "_sum " + number(sum_s) + "\n" + name + "_count " + std::to_string(below) + "\n";
}

using Count = std::atomic<std::uint64_t> LoopMetrics::*;

std::uint64_t sumOf(Loops loops, Count which) {
  std::uint64_t sum = 0;
  for (const LoopMetrics* loop : loops) sum += (loop->*which).load(std::memory_order_relaxed);
  return sum;
}

struct Named {
  const char *label, *help;
  Count which;
};

}  // namespace

void Histogram::add(std::chrono::steady_clock::duration time, std::uint64_t times) {
  const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(time).count();
  const double seconds = static_cast<double>(ns) * 1e-9;
  std::size_t bucket = 0;
  while (bucket < kBounds_s.size() && seconds > kBounds_s[bucket]) ++bucket;
  // one writer: no need for a locked addition
  counts_[bucket].store(count(bucket) + times, std::memory_order_relaxed);
  sum_ns_.store(sum_ns_.load(std::memory_order_relaxed) + times * static_cast<std::uint64_t>(ns > 0 ? ns : 0),
                std::memory_order_relaxed);
}

std::string prometheusText(std::span<const LoopMetrics* const> loops, bool realtime) {
  std::string out;
  histogram(out, loops, "spinaltap_cycle_seconds", "Time to drill and record one pose.", &LoopMetrics::cycle);
  histogram(out, loops, "spinaltap_answer_seconds", "Time from reading a batch of poses to its answer being sent.",
            &LoopMetrics::answer);
  histogram(out, loops, "spinaltap_jitter_seconds",
            "Difference between the time from batch to batch here and on the device's clock.", &LoopMetrics::jitter);
  for (const Named& counter :
       {Named{"spinaltap_cycles_total", "Poses drilled.", &LoopMetrics::cycles},
        Named{"spinaltap_refused_poses_total", "Poses that were none.", &LoopMetrics::refused},
        Named{"spinaltap_late_samples_total", "Batches answered more than a millisecond after they were read.",
              &LoopMetrics::late},
        Named{"spinaltap_lost_samples_total", "Feedback never sent: a newer one took its place.",
              &LoopMetrics::coalesced},
        Named{"spinaltap_overloads_total", "Times that a session fell behind its poses.", &LoopMetrics::overloads},
        Named{"spinaltap_cut_loose_total", "Connections that took nothing for too long.", &LoopMetrics::cut_loose},
        Named{"spinaltap_resumed_total", "Sessions resumed.", &LoopMetrics::resumed}}) {
    head(out, counter.label, "counter", counter.help);
    out += std::string(counter.label) + " " + std::to_string(sumOf(loops, counter.which)) + "\n";
  }
  head(out, "spinaltap_sessions", "gauge", "Drill sessions by state.");
  out += "spinaltap_sessions{state=\"live\"} " + std::to_string(sumOf(loops, &LoopMetrics::live)) + "\n";
  out += "spinaltap_sessions{state=\"paused\"} " + std::to_string(sumOf(loops, &LoopMetrics::paused)) + "\n";
  head(out, "spinaltap_watchers", "gauge", "Connections that watch.");
  out += "spinaltap_watchers " + std::to_string(sumOf(loops, &LoopMetrics::watching)) + "\n";
  head(out, "spinaltap_queue_depth", "gauge", "What waits, by queue.");
  for (const Named& queue :
       {Named{"poses", "", &LoopMetrics::poses_waiting}, Named{"input_bytes", "", &LoopMetrics::input_bytes_waiting},
        Named{"feedback", "", &LoopMetrics::feedback_waiting},
        Named{"disk_bytes", "", &LoopMetrics::disk_bytes_waiting}}) {
    out += std::string("spinaltap_queue_depth{queue=\"") + queue.label + "\"} " +
           std::to_string(sumOf(loops, queue.which)) + "\n";
  }
  head(out, "spinaltap_realtime", "gauge", "1 when the loops run under SCHED_FIFO.");
  out += std::string("spinaltap_realtime ") + (realtime ? "1" : "0") + "\n";
  return out;
}

}  // namespace spinaltap::ws
