#include "app/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

namespace doppel::app {

double milliseconds_since_process_start() {
  std::ifstream stat("/proc/self/stat");
  std::string text((std::istreambuf_iterator<char>(stat)), {});
  const std::size_t after_name = text.rfind(')');  // the program's name may hold spaces and parentheses
  if (after_name == std::string::npos) return 0.0;
  std::istringstream fields(text.substr(after_name + 1));
  std::string field;
  for (int i = 3; i <= 22 && fields >> field; ++i) {
  }
  const double started_s = std::strtod(field.c_str(), nullptr) / static_cast<double>(sysconf(_SC_CLK_TCK));
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return (static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9 - started_s) * 1e3;
}

double peak_rss_mb() {
  // The kernel keeps ru_maxrss across exec, so that it may be that of the program that started this one.
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return std::strtod(line.c_str() + 6, nullptr) * 1024.0 / 1e6;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024.0 / 1e6;
}

std::string shell_quoted(const std::string& argument) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./+,:@%=";
  if (!argument.empty() && argument.find_first_not_of(kPlain) == std::string::npos) return argument;
  std::string out = "'";
  for (const char c : argument) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

std::string own_command_line() {
  std::ifstream arguments("/proc/self/cmdline", std::ios::binary);
  std::string argument, out;
  while (std::getline(arguments, argument, '\0')) {
    out += out.empty() ? shell_quoted(std::filesystem::path(argument).filename().string())
                       : " " + shell_quoted(argument);
  }
  return out;
}

void fill_standard_files() {
  for (int file = open("/dev/null", O_RDWR); file >= 0; file = dup(file)) {
    if (file <= STDERR_FILENO) continue;
    close(file);
    return;
  }
}

namespace {

std::atomic<bool> requested{false};

}  // namespace

void request_stop() {
  requested = true;
}

const std::atomic<bool>& stop_on_signals() {
  struct sigaction action {};
  // The handling of the first one, or the loading of a model, may take long; a second one does not wait for
  // it.
  action.sa_handler = [](int signal) {
    if (!requested.exchange(true)) return;
    constexpr char kShowCursor[] = "\x1b[?25h";  // the live table hides it
    pollfd room{STDOUT_FILENO, POLLOUT, 0};      // none after Ctrl-S, and write() would wait
    if (isatty(STDOUT_FILENO) != 0 && poll(&room, 1, 0) > 0)
      static_cast<void>(!write(STDOUT_FILENO, kShowCursor, sizeof kShowCursor - 1));
    _exit(128 + signal);
  };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  struct sigaction hang_up {};
  sigaction(SIGHUP, nullptr, &hang_up);
  if (hang_up.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);  // ignored: by nohup
  return requested;
}

}  // namespace doppel::app
