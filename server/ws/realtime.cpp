#include "server/ws/realtime.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

namespace spinaltap::ws {
namespace {

/// Above what else runs under SCHED_FIFO by default (kernel threads of drivers run at 50, which we must not starve).
constexpr int kPriority = 20;

std::string refused(int error) { return std::string("refused (") + std::strerror(error) + ")"; }

std::string askForMemory(bool& granted) {
  // With a limit, later requests for memory would fail instead of being merely not locked.
  rlimit limit{};
  if (::geteuid() != 0 && (::getrlimit(RLIMIT_MEMLOCK, &limit) != 0 || limit.rlim_cur != RLIM_INFINITY)) {
    return "memory not locked (its limit is " + std::to_string(limit.rlim_cur / 1024) + " KiB)";
  }
  if (::mlockall(MCL_CURRENT | MCL_FUTURE) != 0) return "memory not locked: " + refused(errno);
  granted = true;
  return "memory locked";
}

std::vector<int> cpusAllowed() {
  cpu_set_t set;
  CPU_ZERO(&set);
  std::vector<int> cpus;
  if (::sched_getaffinity(0, sizeof set, &set) != 0) return cpus;
  for (int cpu = CPU_SETSIZE - 1; cpu >= 0; --cpu) {
    if (CPU_ISSET(cpu, &set)) cpus.push_back(cpu);
  }
  return cpus;
}

std::string askForCpus(std::span<const std::thread::native_handle_type> threads, bool& granted) {
  const std::vector<int> cpus = cpusAllowed();  // the last first: interrupts tend to come to CPU 0
  if (cpus.size() <= threads.size()) return "no CPU to spare for the live loops";
  std::string names;
  for (std::size_t i = 0; i < threads.size(); ++i) {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(cpus[i], &one);
    if (const int error = ::pthread_setaffinity_np(threads[i], sizeof one, &one); error != 0) {
      return "CPU affinity " + refused(error);
    }
    names += (i > 0 ? ", " : "") + std::to_string(cpus[i]);
  }
  granted = true;
  return "live loops on CPU " + names;
}

}  // namespace

std::string askForFifo(std::span<const std::thread::native_handle_type> threads, bool& granted) {
  sched_param parameter{};
  parameter.sched_priority = kPriority;
  for (const auto thread : threads) {
    if (const int error = ::pthread_setschedparam(thread, SCHED_FIFO, &parameter); error != 0) {
      return "SCHED_FIFO " + refused(error);
    }
  }
  granted = true;
  return "SCHED_FIFO granted";
}

RealtimeGrant askForRealtime(std::span<const std::thread::native_handle_type> threads) {
  RealtimeGrant grant;
  grant.line = askForFifo(threads, grant.fifo);
  grant.line += ", " + askForMemory(grant.locked);
  grant.line += ", " + askForCpus(threads, grant.pinned);
  return grant;
}

void yieldToLiveLoops() {
  constexpr int kNice = 10;
  // of the thread alone, on Linux; one that may not is no worse off
  (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNice);
}

}  // namespace spinaltap::ws
