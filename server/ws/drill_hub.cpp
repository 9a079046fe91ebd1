#include "server/ws/drill_hub.h"

#include <unistd.h>

#include <algorithm>
#include <thread>

#include "server/ws/realtime.h"

namespace spinaltap::ws {

Result<std::unique_ptr<DrillHub>> DrillHub::start(store::Store& store, const HubOptions& options) {
  std::unique_ptr<DrillHub> hub(new DrillHub);
  const std::size_t count =
      options.loops > 0 ? options.loops : std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, 4);
  for (std::size_t i = 0; i < count; ++i) {
    auto loop = DrillLoop::start(store, *hub->tasks_, options.loop, [&places = *hub](const std::string& id) {
      const std::scoped_lock lock(places.mutex_);
      places.places_.erase(id);
    });
    if (!loop) return tl::unexpected(loop.error());
    hub->loops_.push_back(std::move(*loop));
  }
  if (!options.realtime) return hub;
  std::vector<std::thread::native_handle_type> threads;
  for (const auto& loop : hub->loops_) threads.push_back(loop->thread());
  const RealtimeGrant grant = askForRealtime(threads);
  hub->realtime_ = grant.fifo;
  hub->realtime_line_ = grant.line;
  for (const auto& loop : hub->loops_) loop->setRealtime(grant.fifo);
  return hub;
}

bool DrillHub::knows(const std::string& id) const {
  const std::scoped_lock lock(mutex_);
  return places_.contains(id);
}

Result<void> DrillHub::begin(const std::string& id, const Ticket& ticket) {
  const std::scoped_lock lock(mutex_);
  if (places_.size() >= kMostLive) return fail(ErrorCode::Limit, "too many drills at once");
  std::vector<std::size_t> used(loops_.size(), 0);
  for (const auto& [other, place] : places_) ++used[place.loop];
  const auto least = std::min_element(used.begin(), used.end());
  places_.emplace(id, Place{ticket, static_cast<std::size_t>(least - used.begin()), true});
  return {};
}

void DrillHub::adopt(int socket, const std::string& id, std::vector<std::byte> already_read) {
  const std::scoped_lock lock(mutex_);
  const auto found = places_.find(id);
  if (found == places_.end()) {
    ::close(socket);
    return;
  }
  Place& place = found->second;
  const std::optional<Ticket> first = std::exchange(place.is_new, false) ? std::optional(place.ticket) : std::nullopt;
  loops_[place.loop]->adopt(socket, id, first, std::move(already_read));
}

std::string DrillHub::metricsText() const {
  std::vector<const LoopMetrics*> all;
  for (const auto& loop : loops_) all.push_back(&loop->metrics());
  return prometheusText(all, realtime_);
}

void DrillHub::stop() {
  for (const auto& loop : loops_) loop->stop();
  if (tasks_) tasks_->stop();
}

}  // namespace spinaltap::ws
