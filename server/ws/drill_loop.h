// server/ws/drill_loop.h - one thread that serves many live drills, and does nothing else: sockets in, poses through
// the core, feedback out. Files are read and written by another thread (TaskThread).
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "server/ws/connection.h"
#include "server/ws/live_drill.h"
#include "server/ws/loop_metrics.h"
#include "server/ws/task_thread.h"

namespace spinaltap::ws {

struct LoopOptions {
  std::chrono::milliseconds patience{60'000};  ///< for a driver who vanished, and for the first to come
  std::chrono::milliseconds stall{10'000};     ///< for a reader who takes nothing
  std::chrono::milliseconds overload{250};     ///< so long behind what came, and the driver is told
  bool realtime = false;                       ///< what welcome says: granted
};

class DrillLoop {
 public:
  static constexpr std::size_t kMostWatchers = 16;
  static constexpr std::size_t kMostClients = 1024;
  /// Poses of one session before the next has its turn.
  static constexpr std::size_t kSlice = 32;

  /// @param gone  called from the loop's thread when a session is no more. @error Io: no handles left.
  [[nodiscard]] static Result<std::unique_ptr<DrillLoop>> start(store::Store& store, TaskThread& tasks,
                                                                const LoopOptions& options,
                                                                std::function<void(const std::string&)> gone);
  DrillLoop(const DrillLoop&) = delete;
  DrillLoop& operator=(const DrillLoop&) = delete;
  ~DrillLoop();

  /// From any thread. `socket` speaks WebSocket from here on, and is the loop's. With a ticket the session begins;
  /// without, it must be there still, or the socket is closed.
  void adopt(int socket, const std::string& id, const std::optional<Ticket>& first,
             std::vector<std::byte> already_read);
  /// Runs a task on the loop's thread.
  void post(std::function<void()> task);
  /// Says goodbye to all connections and hands every recording to the task thread. Waits for the thread.
  void stop();
  [[nodiscard]] const LoopMetrics& metrics() const { return metrics_; }
  [[nodiscard]] std::thread::native_handle_type thread() { return thread_.native_handle(); }
  void setRealtime(bool realtime) { realtime_ = realtime; }

 private:
  struct Seat;
  struct Client;
  using Clients = std::map<int, std::unique_ptr<Client>>;

  DrillLoop(store::Store& store, TaskThread& tasks, const LoopOptions& options,
            std::function<void(const std::string&)> gone, int poll, int wake);

  void run();
  void runPosted();
  void serve(Client& client);
  bool onFrame(Client& client, const FrameReader::Frame& frame);
  void onMessage(Client& client, std::span<const std::byte> bytes);
  void onHello(Client& client, const wire::Hello& hello);
  void watch(Client& client, const wire::Hello& hello);
  void drive(Client& client, const wire::Hello& hello);
  void resume(Client& client, const wire::Hello& hello);
  void open(Seat& seat, const wire::Hello& hello);
  void opened(const std::string& id, std::unique_ptr<LiveDrill> live, const Error& error);
  void welcome(Client& client);
  void onPoses(Client& client, std::span<const std::byte> bytes);
  void onFinish(Client& client);
  void finished(const std::string& id, const LiveDrill::Kept& kept);
  void drillSlice(Seat& seat);
  void answer(Seat& seat);
  void measureArrival(Seat& seat);

  void refuse(Client& client, const std::string& reason, std::uint16_t code);
  void tellWatchers(Seat& seat, const wire::ServerMessage& message);
  void leave(Client& client);
  void drop(int socket);
  void end(Seat& seat, const std::string& reason);
  void erase(const std::string& id);
  [[nodiscard]] std::vector<Client*> clientsOf(const Seat& seat) const;
  void flush(Client& client);
  void housekeeping();
  void checkClient(Client& client);
  void count();
  void closeAll();

  store::Store& store_;
  TaskThread& tasks_;
  LoopOptions options_;
  std::function<void(const std::string&)> gone_;
  int poll_, wake_;
  std::atomic<bool> realtime_;
  LoopMetrics metrics_;

  std::mutex posted_mutex_;
  std::vector<std::function<void()>> posted_;
  std::atomic<bool> stopping_ = false;

  // all that follows is the thread's own
  Clock::time_point now_ = Clock::now(), checked_{};
  std::map<std::string, std::unique_ptr<Seat>> seats_;
  Clients clients_;
  std::vector<std::unique_ptr<Client>> dropped_;  ///< freed at the end of the turn, as
  std::vector<std::unique_ptr<Seat>> ended_;      ///< these
  std::vector<Client*> unread_, still_unread_;    ///< who has more for us than its turn allowed
  std::vector<Client*> held_;                     ///< whose feedback waits for its time
  std::thread thread_;                            // last: it uses all of the above
};

}  // namespace spinaltap::ws
