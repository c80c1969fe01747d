#include "doppel/base/core/detail/confinement.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <linux/prctl.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <utility>

namespace doppel {
namespace {

// The numbers of calls and the order of words are those of these two; others have no filter.
#if defined(__x86_64__) || defined(__aarch64__)
#ifdef __x86_64__
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#else
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#endif

constexpr std::uint32_t kDenied = SECCOMP_RET_ERRNO | EPERM;
// The C library then tries the older call, which is checked.
constexpr std::uint32_t kMissing = SECCOMP_RET_ERRNO | ENOSYS;

// Calls without an effect outside of the process.
constexpr int kAllowed[] = {
    // files and pipes that are open
    SYS_read,
    SYS_readv,
    SYS_pread64,
    SYS_preadv,
    SYS_write,
    SYS_writev,
    SYS_lseek,
    SYS_close,
    SYS_close_range,
    SYS_dup,
    SYS_dup3,
    SYS_pipe2,
    SYS_eventfd2,
    SYS_epoll_create1,
    SYS_epoll_ctl,
    SYS_epoll_pwait,
    SYS_ppoll,
    SYS_pselect6,
    SYS_fadvise64,
    // the names and states of files
    SYS_fstat,
    SYS_newfstatat,
    SYS_statx,
    SYS_statfs,
    SYS_fstatfs,
    SYS_getdents64,
    SYS_readlinkat,
    SYS_faccessat,
    SYS_getcwd,
    SYS_chdir,
    SYS_fchdir,
    SYS_umask,
    // memory
    SYS_brk,
    SYS_mmap,
    SYS_munmap,
    SYS_mremap,
    SYS_mprotect,
    SYS_madvise,
    SYS_mincore,
    SYS_membarrier,
    // threads and signals of the process itself
    SYS_futex,
    SYS_set_robust_list,
    SYS_get_robust_list,
    SYS_set_tid_address,
    SYS_sched_yield,
    SYS_sched_getaffinity,
    SYS_getcpu,
    SYS_rt_sigaction,
    SYS_rt_sigprocmask,
    SYS_rt_sigreturn,
    SYS_sigaltstack,
    SYS_restart_syscall,
    SYS_exit,
    SYS_exit_group,
    SYS_wait4,
    // time, numbers, limits
    SYS_nanosleep,
    SYS_clock_nanosleep,
    SYS_clock_gettime,
    SYS_clock_getres,
    SYS_gettimeofday,
    SYS_times,
    SYS_getrandom,
    SYS_getrusage,
    SYS_getrlimit,
    SYS_uname,
    SYS_sysinfo,
    SYS_getpid,
    SYS_getppid,
    SYS_gettid,
    SYS_getuid,
    SYS_geteuid,
    SYS_getgid,
    SYS_getegid,
    SYS_getgroups,
    SYS_getresuid,
    SYS_getresgid,
    SYS_getpgid,
    SYS_getsid,
#ifdef SYS_rseq
    SYS_rseq,
#endif
#ifdef SYS_faccessat2
    SYS_faccessat2,
#endif
#ifdef __x86_64__
    SYS_stat,
    SYS_lstat,
    SYS_access,
    SYS_readlink,
    SYS_getdents,
    SYS_poll,
    SYS_select,
    SYS_dup2,
    SYS_pipe,
    SYS_epoll_create,
    SYS_epoll_wait,
    SYS_time,
    SYS_getpgrp,
    SYS_arch_prctl,
#endif
};

// Effects that programs try; what is in neither list does not exist for the child.
constexpr int kRefused[] = {
    SYS_unlinkat,
    SYS_renameat,
    SYS_renameat2,
    SYS_mkdirat,
    SYS_linkat,
    SYS_symlinkat,
    SYS_mknodat,
    SYS_fchmod,
    SYS_fchmodat,
    SYS_fchown,
    SYS_fchownat,
    SYS_truncate,
    SYS_ftruncate,
    SYS_fallocate,
    SYS_utimensat,
    SYS_setxattr,
    SYS_lsetxattr,
    SYS_fsetxattr,
    SYS_removexattr,
    SYS_flock,
    SYS_fsync,
    SYS_fdatasync,
    SYS_socket,
    SYS_socketpair,
    SYS_connect,
    SYS_bind,
    SYS_listen,
    SYS_accept4,
    SYS_sendto,
    SYS_sendmsg,
    SYS_execve,
    SYS_kill,
    SYS_tkill,
    SYS_tgkill,
    SYS_rt_sigqueueinfo,
    SYS_ptrace,
    SYS_process_vm_readv,
    SYS_process_vm_writev,
    SYS_setpgid,
    SYS_setsid,
    SYS_setuid,
    SYS_setgid,
    SYS_setrlimit,
    SYS_setpriority,
    SYS_sched_setaffinity,
    SYS_sched_setscheduler,
    SYS_sched_setparam,
    SYS_chroot,
    SYS_mount,
    SYS_umount2,
    SYS_unshare,
    SYS_setns,
#ifdef __x86_64__
    SYS_unlink,
    SYS_rename,
    SYS_mkdir,
    SYS_rmdir,
    SYS_link,
    SYS_symlink,
    SYS_mknod,
    SYS_creat,
    SYS_chmod,
    SYS_chown,
    SYS_lchown,
    SYS_utime,
    SYS_utimes,
    SYS_futimesat,
    SYS_fork,
    SYS_vfork,
#endif
};

sock_filter statement(int code, std::uint32_t value) {
  return {static_cast<std::uint16_t>(code), 0, 0, value};
}
// Skips `yes` or `no` instructions.
sock_filter jump(int code, std::uint32_t value, int yes, int no) {
  return {static_cast<std::uint16_t>(code), static_cast<std::uint8_t>(yes), static_cast<std::uint8_t>(no),
          value};
}
constexpr int kLoad = BPF_LD | BPF_W | BPF_ABS, kReturn = BPF_RET | BPF_K, kAnd = BPF_ALU | BPF_AND | BPF_K,
              kIsEqual = BPF_JMP | BPF_JEQ | BPF_K, kIsAtLeast = BPF_JMP | BPF_JGE | BPF_K;

class Filter {
 public:
  void begin() {
    add(statement(kLoad, offsetof(seccomp_data, arch)));
    add(jump(kIsEqual, kArchitecture, 1, 0));
    add(statement(kReturn, SECCOMP_RET_KILL_PROCESS));
    add(statement(kLoad, offsetof(seccomp_data, nr)));
#ifdef __X32_SYSCALL_BIT
    add(jump(kIsAtLeast, __X32_SYSCALL_BIT, 0, 1));
    add(statement(kReturn, SECCOMP_RET_KILL_PROCESS));
#endif
  }
  void answer(int call, std::uint32_t with) {
    add(jump(kIsEqual, static_cast<std::uint32_t>(call), 0, 1));
    add(statement(kReturn, with));
  }
  // Allowed where `argument & mask` is one of these values.
  void allow_if(int call, int argument, std::uint32_t mask, std::initializer_list<std::uint32_t> values) {
    const int count = static_cast<int>(values.size());
    add(jump(kIsEqual, static_cast<std::uint32_t>(call), 0, count + 4));
    add(statement(kLoad, low_word(argument)));
    add(statement(kAnd, mask));
    int left = count;
    for (const std::uint32_t value : values) add(jump(kIsEqual, value, left--, 0));
    add(statement(kReturn, kDenied));
    add(statement(kReturn, SECCOMP_RET_ALLOW));
  }
  // Allowed where the pointer is null.
  void allow_if_null(int call, int argument) {
    add(jump(kIsEqual, static_cast<std::uint32_t>(call), 0, 6));
    add(statement(kLoad, low_word(argument)));
    add(jump(kIsEqual, 0, 0, 2));
    add(statement(kLoad, low_word(argument) + 4));
    add(jump(kIsEqual, 0, 1, 0));
    add(statement(kReturn, kDenied));
    add(statement(kReturn, SECCOMP_RET_ALLOW));
  }
  void end() {
    add(statement(kReturn, kMissing));
  }
  std::vector<sock_filter> take() {
    return std::move(instructions_);
  }

 private:
  void add(sock_filter instruction) {
    instructions_.push_back(instruction);
  }
  // Both processors have the low word first.
  static std::uint32_t low_word(int argument) {
    return static_cast<std::uint32_t>(offsetof(seccomp_data, args) + sizeof(std::uint64_t) * argument);
  }
  std::vector<sock_filter> instructions_;
};

void add_conditional_calls(Filter& filter) {
  constexpr auto kChanges =
      static_cast<std::uint32_t>(O_ACCMODE | O_CREAT | O_TRUNC | (O_TMPFILE & ~O_DIRECTORY));
  filter.allow_if(SYS_openat, 2, kChanges, {O_RDONLY});
#ifdef SYS_open
  filter.allow_if(SYS_open, 1, kChanges, {O_RDONLY});
#endif
  // Signals of descriptors, leases and locks reach other processes.
  filter.allow_if(SYS_fcntl, 1, ~0U, {F_DUPFD, F_DUPFD_CLOEXEC, F_GETFD, F_SETFD, F_GETFL, F_SETFL});
  filter.allow_if(SYS_ioctl, 1, ~0U, {TCGETS, TIOCGWINSZ, FIOCLEX, FIONCLEX, FIONREAD});
  // Threads, and no processes or namespaces.
  constexpr std::uint32_t kSpaces = CLONE_NEWNS | CLONE_NEWCGROUP | CLONE_NEWUTS | CLONE_NEWIPC |
                                    CLONE_NEWUSER | CLONE_NEWPID | CLONE_NEWNET;
  filter.allow_if(SYS_clone, 0, CLONE_THREAD | CLONE_PTRACE | CLONE_VFORK | kSpaces, {CLONE_THREAD});
#ifdef PR_SET_VMA
  filter.allow_if(SYS_prctl, 0, ~0U, {PR_SET_NAME, PR_GET_NAME, PR_GET_DUMPABLE, PR_SET_VMA});
#else
  filter.allow_if(SYS_prctl, 0, ~0U, {PR_SET_NAME, PR_GET_NAME, PR_GET_DUMPABLE});
#endif
  filter.allow_if(SYS_execveat, 0, ~0U, {kProgramDescriptor});
  filter.allow_if_null(SYS_prlimit64, 2);
}

std::vector<sock_filter> filter_of_processor() {
  Filter filter;
  filter.begin();
  add_conditional_calls(filter);
  for (const int call : kAllowed) filter.answer(call, SECCOMP_RET_ALLOW);
  for (const int call : kRefused) filter.answer(call, kDenied);
  filter.end();
  return filter.take();
}
#else
std::vector<sock_filter> filter_of_processor() {
  return {};
}
#endif

constexpr rlim_t kMaxProcessorTime = 10;  // s
constexpr rlim_t kMaxAddressSpace = rlim_t{4}
                                    << 30U;  // bytes; libraries of Python reserve more than they use

bool is_limited(int resource, rlim_t most) {
  rlimit limit{};
  if (getrlimit(static_cast<__rlimit_resource>(resource), &limit) != 0) return false;
  if (limit.rlim_max != RLIM_INFINITY && limit.rlim_max < most) most = limit.rlim_max;
  limit = {most, most};
  return setrlimit(static_cast<__rlimit_resource>(resource), &limit) == 0;
}

// In a domain of Landlock, a process cannot look into those outside of it: their environments
// (/proc/N/environ) have what its own is without, and a filter of calls sees no path. The domain has to
// handle a right; that of making block devices is none that the filter leaves. Kernels before 5.13, and some
// containers, have no Landlock: there the filter alone confines. Root looks into every process by these
// capabilities, and gets none back from the program that is started, because it may have no new privileges.
void enter_own_domain() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct sets[_LINUX_CAPABILITY_U32S_3] = {};
  if (syscall(SYS_capget, &header, sets) == 0) {
    for (const int capability : {CAP_SYS_PTRACE, CAP_SYS_ADMIN, CAP_PERFMON}) {
      __user_cap_data_struct& set = sets[CAP_TO_INDEX(capability)];
      for (__u32* const kind : {&set.effective, &set.permitted, &set.inheritable})
        *kind &= ~CAP_TO_MASK(capability);
    }
    syscall(SYS_capset, &header, sets);
  }
  // Newer headers have more members, which a list of initializers would have to name.
  landlock_ruleset_attr rights{};
  rights.handled_access_fs = LANDLOCK_ACCESS_FS_MAKE_BLOCK;
  const auto domain =
      static_cast<int>(syscall(SYS_landlock_create_ruleset, &rights, sizeof rights.handled_access_fs, 0));
  if (domain < 0) return;
  syscall(SYS_landlock_restrict_self, domain, 0);
  close(domain);
}

}  // namespace

std::vector<sock_filter> confining_filter() {
  return filter_of_processor();
}

int confine(const std::vector<sock_filter>& filter) {
  if (filter.empty()) return ENOSYS;
  // A core file would be a file, too.
  const bool limited = is_limited(RLIMIT_CPU, kMaxProcessorTime) && is_limited(RLIMIT_AS, kMaxAddressSpace) &&
                       is_limited(RLIMIT_CORE, 0) && is_limited(RLIMIT_FSIZE, 0) &&
                       is_limited(RLIMIT_NOFILE, kMaxConfinedDescriptors);
  if (!limited) return errno;
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return errno;
  enter_own_domain();
  const sock_fprog program{static_cast<std::uint16_t>(filter.size()),
                           const_cast<sock_filter*>(filter.data())};
  return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0) == 0 ? 0 : errno;
}

}  // namespace doppel
