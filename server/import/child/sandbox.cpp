#include "server/import/child/sandbox.h"

#include <fcntl.h>
#include <seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>

#include "server/import/protocol.h"
#include "server/import/sanitized.h"

namespace spinaltap::importer {

namespace {

void setLimit(__rlimit_resource resource, rlim_t soft, rlim_t hard) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0) return;
  limit.rlim_max = std::min(limit.rlim_max, hard);
  limit.rlim_cur = std::min(limit.rlim_max, soft);
  setrlimit(resource, &limit);
}

void setLimit(__rlimit_resource resource, rlim_t value) { setLimit(resource, value, value); }

/// Pages mapped now: code, libraries, the input in memory.
std::uint64_t addressSpaceInUse() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t pages = 0;
  statm >> pages;
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void limitAddressSpace(const ImportLimits& limits, std::uint64_t input_bytes, std::uint64_t extra_bytes) {
#if !SPINALTAP_SANITIZED
  // A parser may hold a file, its parsed copy, the decoded pixels and a codec's 32-bit planes of a slice at once; eight
  // times the input covers compression up to that, and the floor covers small files. A file that claims gigabytes gets
  // none.
  constexpr std::uint64_t kFloor = std::uint64_t{192} << 20;
  const std::uint64_t wanted = addressSpaceInUse() + kFloor + 8 * input_bytes + extra_bytes;
  setLimit(RLIMIT_AS, std::min(wanted, limits.memory_bytes));
#else
  (void)limits, (void)input_bytes, (void)extra_bytes, (void)addressSpaceInUse;
#endif
}

class Filter {
 public:
  explicit Filter(std::uint32_t default_action) : context_(seccomp_init(default_action)), good_(context_ != nullptr) {}
  Filter(const Filter&) = delete;
  Filter& operator=(const Filter&) = delete;
  ~Filter() {
    if (context_ != nullptr) seccomp_release(context_);
  }
  void rule(std::uint32_t action, int call) { keep(seccomp_rule_add(context_, action, call, 0)); }
  void rule(std::uint32_t action, int call, const scmp_arg_cmp& argument) {
    keep(seccomp_rule_add(context_, action, call, 1, argument));
  }
  [[nodiscard]] bool load() { return good_ && seccomp_load(context_) == 0; }

 private:
  void keep(int result) { good_ = good_ && result == 0; }
  scmp_filter_ctx context_;
  bool good_;
};

#if !SPINALTAP_SANITIZED

bool installFilter() {
  Filter filter(SCMP_ACT_ERRNO(EPERM));
  // Memory, never executable; how a process ends; clocks. (Input is in memory and libraries are bound: no open, no
  // read.)
  for (const int call : {SCMP_SYS(mmap), SCMP_SYS(mprotect)}) {
    filter.rule(SCMP_ACT_ALLOW, call, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
  }
  for (const int call :
       {SCMP_SYS(munmap), SCMP_SYS(mremap), SCMP_SYS(brk), SCMP_SYS(madvise), SCMP_SYS(futex), SCMP_SYS(exit),
        SCMP_SYS(exit_group), SCMP_SYS(rt_sigreturn), SCMP_SYS(rt_sigprocmask), SCMP_SYS(getpid), SCMP_SYS(gettid),
        SCMP_SYS(clock_gettime), SCMP_SYS(gettimeofday), SCMP_SYS(getrandom)}) {
    filter.rule(SCMP_ACT_ALLOW, call);
  }
  // abort() signals its own thread; it can reach no other process.
  filter.rule(SCMP_ACT_ALLOW, SCMP_SYS(tgkill), SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(getpid())));
  for (const int fd : {STDOUT_FILENO, kProgressDescriptor}) {
    filter.rule(SCMP_ACT_ALLOW, SCMP_SYS(write), SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(fd)));
  }
  return filter.load();
}

#else

/// AddressSanitizer opens /proc and its symboliser's files to report, so here only the way out is shut.
bool installFilter() {
  Filter filter(SCMP_ACT_ALLOW);
  for (const int call : {SCMP_SYS(socket), SCMP_SYS(connect), SCMP_SYS(execve), SCMP_SYS(execveat), SCMP_SYS(fork),
                         SCMP_SYS(vfork), SCMP_SYS(unlink), SCMP_SYS(rename), SCMP_SYS(kill), SCMP_SYS(creat)}) {
    filter.rule(SCMP_ACT_ERRNO(EPERM), call);
  }
  for (const int access : {O_WRONLY, O_RDWR}) {
    filter.rule(SCMP_ACT_ERRNO(EPERM), SCMP_SYS(open),
                SCMP_A1(SCMP_CMP_MASKED_EQ, O_ACCMODE, static_cast<scmp_datum_t>(access)));
    filter.rule(SCMP_ACT_ERRNO(EPERM), SCMP_SYS(openat),
                SCMP_A2(SCMP_CMP_MASKED_EQ, O_ACCMODE, static_cast<scmp_datum_t>(access)));
  }
  return filter.load();
}

#endif

}  // namespace

void limitResources(const ImportLimits& limits) {
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  prctl(PR_SET_DUMPABLE, 0);
  setLimit(RLIMIT_CORE, 0);
#if !SPINALTAP_SANITIZED  // its report may go to a file
  setLimit(RLIMIT_FSIZE, 0);
#endif
  setLimit(RLIMIT_NPROC, 0);
  setLimit(RLIMIT_NOFILE, 64);
  // Sequences nest and the parser recurses: 5000 levels need about 8 MiB.
  setLimit(RLIMIT_STACK, rlim_t{64} << 20);
  const auto seconds = static_cast<rlim_t>(limits.wall_time.count() / 1000 + 1);
  setLimit(RLIMIT_CPU, seconds, seconds + 1);
}

Result<void> enterSandbox(const ImportLimits& limits, std::uint64_t input_bytes, std::uint64_t extra_bytes) {
  limitAddressSpace(limits, input_bytes, extra_bytes);
  if (!installFilter()) {
    return fail(ErrorCode::Unsupported,
                "this kernel does not allow the system call filter that import needs (seccomp)");
  }
  return {};
}

int testSandbox() {
  limitResources(ImportLimits{});
  if (auto entered = enterSandbox(ImportLimits{}, 0, 0); !entered) return 1;
  std::string report;
  bool all_forbidden = true;
  const auto trial = [&](const char* what, long result) {
    const bool forbidden = result < 0 && (errno == EPERM || errno == EACCES);
    all_forbidden = all_forbidden && forbidden;
    report += std::string(what) + (forbidden ? " forbidden\n" : " ALLOWED\n");
  };
  std::array<char*, 2> nothing{nullptr, nullptr};
  trial("open-to-write", open("/tmp/spinaltap-sandbox-test", O_WRONLY | O_CREAT, 0600));
  trial("socket", socket(AF_INET, SOCK_STREAM, 0));
  trial("execve", execve("/bin/true", nothing.data(), nothing.data()));
  trial("fork", syscall(SYS_fork));
  trial("unlink", unlink("/tmp/spinaltap-sandbox-test"));
  trial("kill", kill(getppid(), 0));
#if !SPINALTAP_SANITIZED
  std::array<char, 1> byte{};
  trial("open-to-read", open("/etc/passwd", O_RDONLY));
  trial("read", read(STDIN_FILENO, byte.data(), byte.size()));
  trial("write-elsewhere", write(STDERR_FILENO, "x", 1));
  trial("ptrace", syscall(SYS_ptrace, 0, 0, 0, 0));
  trial("executable-memory",
        mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) == MAP_FAILED ? -1 : 0);
#endif
  if (write(STDOUT_FILENO, report.data(), report.size()) != static_cast<ssize_t>(report.size())) return 1;
  return all_forbidden ? 0 : 1;
}

}  // namespace spinaltap::importer
