#include "doppel/base/core/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <span>
#include <sstream>
#include <string_view>
#include <system_error>

#include "doppel/base/core/detail/confinement.h"

extern char** environ;

namespace doppel {
namespace {

constexpr int kRequests = 3, kAnswers = 4;  // descriptors of the child
constexpr int kNotStarted = 127;
constexpr rlim_t kMaxClosed = 65536;  // descriptors, where they are closed one by one

// A confined program inherits these; others may have tokens and passwords.
constexpr std::array<std::string_view, 4> kHarmlessVariables = {"PATH", "LD_LIBRARY_PATH", "ROS_DISTRO",
                                                                "ROS_VERSION"};

// Written by a child that cannot start its program.
struct StartFailure {
  int reason = 0;
  bool of_confinement = false;
};

// Both ends close by themselves in programs that are started later.
struct Pipe {
  FileDescriptor read{-1}, write{-1};
  explicit Pipe(bool needed) {
    if (!needed) return;
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0)
      throw std::system_error(errno, std::generic_category(), "cannot make a pipe");
    read = FileDescriptor(ends[0]);
    write = FileDescriptor(ends[1]);
  }
};

std::vector<std::string> merged_environment(const ChildStart& start) {
  std::vector<std::string> out;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    const std::string name = text.substr(0, text.find('='));
    if (start.confined && std::ranges::find(kHarmlessVariables, name) == kHarmlessVariables.end()) continue;
    const auto is_name = [&](const auto& added) { return added.first == name; };
    if (std::none_of(start.environment.begin(), start.environment.end(), is_name)) out.push_back(text);
  }
  for (const auto& [name, value] : start.environment) out.push_back(name + "=" + value);
  return out;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> out;
  for (std::string& text : texts) out.push_back(text.data());
  out.push_back(nullptr);
  return out;
}

// A pipe's end above the numbers that the child needs for other things, so that none overwrites another.
FileDescriptor moved_up(const FileDescriptor& end) {
  constexpr int kFirstFree = 10;
  return FileDescriptor(end.is_open() ? fcntl(end.get(), F_DUPFD_CLOEXEC, kFirstFree) : -1);
}

// In the child, before its program: only calls that are safe after fork().
struct ChildSide {
  const char* folder;  // nullptr: the parent's
  char** words;
  char** environment;
  int output, requests, answers, failure;
  bool own_group;
  pid_t parent;
  const char* program;                          // of a confined child
  const std::vector<sock_filter>* confinement;  // nullptr: it is not confined

  [[noreturn]] void run() const {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ}) ::signal(signal, SIG_DFL);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    if (own_group) setpgid(0, 0);
    // Code that is not trusted may ignore SIGTERM.
    prctl(PR_SET_PDEATHSIG, confinement != nullptr ? SIGKILL : SIGTERM);
    if (getppid() != parent) _exit(kNotStarted);
    if (output >= 0) {
      dup2(output, STDOUT_FILENO);
      dup2(output, STDERR_FILENO);
      const int nothing = ::open("/dev/null", O_RDONLY);
      dup2(nothing, STDIN_FILENO);
    } else if (confinement != nullptr) {
      const int nothing = ::open("/dev/null", O_RDWR);
      for (const int end : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nothing, end);
    }
    if (requests >= 0) dup2(requests, kRequests);
    if (answers >= 0) dup2(answers, kAnswers);
    StartFailure failed;
    if (folder == nullptr || chdir(folder) == 0) {
      closefrom(requests >= 0 ? kAnswers + 1 : STDERR_FILENO + 1, failure);
      if (confinement == nullptr)
        execvpe(words[0], words, environment);
      else
        failed.of_confinement = !start_confined();
    }
    failed.reason = errno;
    [[maybe_unused]] const ssize_t written = write(failure, &failed, sizeof failed);
    _exit(kNotStarted);
  }

  // Returns false with errno where the child is not confined, true where its program cannot be started.
  [[nodiscard]] bool start_confined() const {
    const int opened = ::open(program, O_RDONLY | O_CLOEXEC);
    if (opened < 0) return true;
    if (dup3(opened, kProgramDescriptor, O_CLOEXEC) < 0) return false;
    if (const int error = confine(*confinement); error != 0) {
      errno = error;
      return false;
    }
    syscall(SYS_execveat, kProgramDescriptor, "", words, environment, AT_EMPTY_PATH);
    return true;
  }

  // All descriptors from the first one on, but for the one that reports a failure and closes by itself.
  static void closefrom(int first, int kept) {
    const auto begin = static_cast<unsigned>(first), stays = static_cast<unsigned>(kept);
    bool closed = stays <= begin || close_range(begin, stays - 1, 0) == 0;
    closed = close_range(stays + 1, ~0U, 0) == 0 && closed;
    if (closed) return;
    // Kernels before 5.9, and filters of older containers.
    rlimit limit{};
    const bool is_bound = getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur < kMaxClosed;
    for (int one = first; one < static_cast<int>(is_bound ? limit.rlim_cur : kMaxClosed); ++one)
      if (one != kept) ::close(one);
  }
};

int exit_code_of(int status) {
  constexpr int kSignals = 128;
  return WIFSIGNALED(status) ? kSignals + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace

bool is_program(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::is_regular_file(file, error) && access(file.c_str(), X_OK) == 0;
}

std::filesystem::path find_program(const std::string& name) {
  if (name.find('/') != std::string::npos) return is_program(name) ? std::filesystem::path(name) : "";
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (is_program(std::filesystem::path(folder) / name)) return std::filesystem::path(folder) / name;
  }
  return {};
}

ChildProcess::ChildProcess(const ChildStart& start) : own_group_(start.own_group) {
  Pipe output(start.output_piped), requests(start.converses), answers(start.converses), failure(true);
  std::vector<std::string> words = start.words, environment = merged_environment(start);
  std::vector<sock_filter> filter;
  std::string program;
  if (start.confined) {
    filter = confining_filter();
    program = find_program(words.front()).string();
    if (program.empty()) throw std::system_error(ENOENT, std::generic_category(), words.front());
  }
  std::vector<char*> word_pointers = pointers(words), environment_pointers = pointers(environment);
  FileDescriptor ends[] = {moved_up(output.write), moved_up(requests.write), moved_up(answers.read),
                           moved_up(failure.write)};
  const ChildSide child{.folder = start.folder.empty() ? nullptr : start.folder.c_str(),
                        .words = word_pointers.data(),
                        .environment = environment_pointers.data(),
                        .output = ends[0].get(),
                        .requests = ends[1].get(),
                        .answers = ends[2].get(),
                        .failure = ends[3].get(),
                        .own_group = start.own_group,
                        .parent = getpid(),
                        .program = program.c_str(),
                        .confinement = start.confined ? &filter : nullptr};
  pid_ = fork();
  if (pid_ == 0) child.run();
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "cannot start a process");
  if (own_group_) setpgid(pid_, pid_);
  // The only open end is then the child's, which closes when its program starts.
  for (FileDescriptor& end : ends) end = FileDescriptor(-1);
  failure.write = FileDescriptor(-1);
  StartFailure failed;
  if (read_all(failure.read.get(), std::as_writable_bytes(std::span(&failed, 1))) ==
      static_cast<ssize_t>(sizeof failed)) {
    waitpid(pid_, nullptr, 0);
    const std::error_code reason(failed.reason, std::generic_category());
    if (failed.of_confinement) throw ConfinementError(reason.message());
    throw std::system_error(reason, start.words.front());
  }
  output_ = std::move(output.read);
  requests_ = std::move(requests.read);
  answers_ = std::move(answers.write);
}

ChildProcess::~ChildProcess() {
  if (group_ended()) return;
  signal(SIGKILL);
  wait();
}

void ChildProcess::signal(int number) {
  if (!group_ended()) kill(own_group_ ? -pid_ : pid_, number);
}

bool ChildProcess::group_ended() {
  if (!ended() || group_ended_) return group_ended_;
  // Orphans are children of this process where it is the first one of a container.
  while (own_group_ && waitpid(-pid_, nullptr, WNOHANG) > 0) continue;
  // A group without processes is not asked again: another one may get its number.
  group_ended_ = !own_group_ || (kill(-pid_, 0) != 0 && errno == ESRCH);
  return group_ended_;
}

std::optional<int> ChildProcess::ended() {
  int status = 0;
  if (!exit_code_ && waitpid(pid_, &status, WNOHANG) == pid_) exit_code_ = exit_code_of(status);
  return exit_code_;
}

int ChildProcess::wait() {
  int status = 0;
  while (!exit_code_) {
    const pid_t child = waitpid(pid_, &status, 0);
    if (child == pid_) exit_code_ = exit_code_of(status);
    if (child < 0 && errno != EINTR) exit_code_ = kNotStarted;
  }
  return *exit_code_;
}

}  // namespace doppel
