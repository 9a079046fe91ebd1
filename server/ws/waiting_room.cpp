#include "server/ws/waiting_room.h"

#include "server/store/ids.h"

namespace spinaltap::ws {

Result<std::string> WaitingRoom::add(const Ticket& ticket, Clock::time_point now) {
  const std::scoped_lock lock(mutex_);
  std::erase_if(waiting_, [now](const auto& item) { return item.second.until <= now; });
  if (waiting_.size() >= kMostWaiting) return fail(ErrorCode::Limit, "too many drill sessions wait for their socket");
  std::string id = store::randomId('s', 26);
  waiting_.emplace(id, Entry{ticket, now + kPatience});
  return id;
}

std::optional<Ticket> WaitingRoom::take(const std::string& id, Clock::time_point now) {
  const std::scoped_lock lock(mutex_);
  const auto found = waiting_.find(id);
  if (found == waiting_.end()) return {};
  const Entry entry = found->second;
  waiting_.erase(found);
  return entry.until > now ? std::optional(entry.ticket) : std::nullopt;
}

}  // namespace spinaltap::ws
