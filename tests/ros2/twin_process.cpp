#include "twin_process.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "published_hashes.h"

namespace doppel::ros2_testing {
namespace {

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  for (std::string& text : texts) all.push_back(text.data());
  all.push_back(nullptr);
  return all;
}

std::vector<std::string> environment_with(const std::vector<std::string>& variables) {
  std::vector<std::string> all;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    const std::string name = text.substr(0, text.find('=') + 1);
    bool replaced = false;
    for (const std::string& variable : variables) replaced = replaced || variable.starts_with(name);
    if (!replaced) all.push_back(text);
  }
  all.insert(all.end(), variables.begin(), variables.end());
  return all;
}

std::string from_environment(const char* name) {
  const char* value = std::getenv(name);
  if (value == nullptr) throw std::runtime_error(std::string(name) + " is not set; ctest sets it");
  return value;
}

// A TCP port of this machine that is not in use now.
int free_port() {
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  if (bind(listener, generic, size) != 0 || getsockname(listener, generic, &size) != 0)
    throw std::runtime_error("no free TCP port on 127.0.0.1");
  close(listener);
  return ntohs(address.sin_port);
}

// The socket of a domain's name is the lock of the domain; the kernel releases it when the process ends.
bool hold_domain(int domain) {
  const int holder = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const std::string name = "doppel-test-domain-" + std::to_string(domain);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  name.copy(address.sun_path + 1, name.size());  // a first NUL: not in the file system
  if (bind(holder, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return true;
  close(holder);
  return false;
}

}  // namespace

std::filesystem::path source_folder() {
  return from_environment("DOPPEL_ROOT");
}

std::string doppel_program() {
  return from_environment("DOPPEL");
}

int own_domain() {
  static const int domain = [] {
    constexpr int kFirst = 50, kLast = 69;
    int candidate = kFirst;
    while (!hold_domain(candidate)) {
      candidate = candidate == kLast ? kFirst : candidate + 1;
      if (candidate == kFirst) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return candidate;
  }();
  return domain;
}

Process::Process(const std::vector<std::string>& command, const std::vector<std::string>& variables,
                 const std::filesystem::path& log) {
  std::vector<std::string> words = command, entries = environment_with(variables);
  const std::vector<char*> arguments = pointers(words), environment = pointers(entries);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error("fork failed");
  if (pid_ > 0) return;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);  // the parent died before the line above
  const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(file, STDOUT_FILENO);
  dup2(file, STDERR_FILENO);
  execvpe(arguments[0], arguments.data(), environment.data());
  _exit(127);
}

Process::~Process() {
  kill();
}

int Process::reap(int options) {
  int status = 0;
  if (pid_ > 0 && waitpid(pid_, &status, options) == pid_) {
    pid_ = -1;
    exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return exit_code_;
}

bool Process::running() {
  reap(WNOHANG);
  return pid_ > 0;
}

void Process::kill() {
  if (pid_ > 0) ::kill(pid_, SIGKILL);
  reap(0);
}

int Process::interrupt() {
  if (pid_ > 0) ::kill(pid_, SIGINT);
  return reap(0);
}

int Process::wait() {
  return reap(0);
}

TwinProcess::TwinProcess(const std::vector<std::string>& more_arguments, const std::string& robot,
                         const std::string& range) {
  std::string folder = (std::filesystem::temp_directory_path() / "doppel-peers-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error("cannot create the folder " + folder);
  folder_ = folder;
  std::vector<std::string> command = {doppel_program(), "up",     source_folder() / "robots" / robot,
                                      "--headless",     "--port", std::to_string(free_port())};
  command.insert(command.end(), more_arguments.begin(), more_arguments.end());
  variables_ = {"ROS_DOMAIN_ID=" + std::to_string(own_domain()),
                "ROS_AUTOMATIC_DISCOVERY_RANGE=" + range,
                "ROS_LOCALHOST_ONLY=",
                "ROS_STATIC_PEERS=",
                "XDG_RUNTIME_DIR=" + folder,
                "ROS_DISTRO=" + twin_distro()};
  process_ = std::make_unique<Process>(command, variables_, folder_ / "output");
}

TwinProcess::~TwinProcess() {
  process_.reset();
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string TwinProcess::output() const {
  std::ifstream file(folder_ / "output");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace doppel::ros2_testing
