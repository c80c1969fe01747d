#include "app/browser.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>

#include "doppel/base/core/child_process.h"
#include "doppel/base/core/guarded_thread.h"

namespace doppel::app {
namespace {

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

bool has_desktop_session() {
  return (is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")) && !is_set("SSH_CONNECTION") &&
         isatty(STDOUT_FILENO) != 0 && !find_program("xdg-open").empty();
}

// In a session of its own, so that Ctrl-C does not end the browser; without open files and output.
void spawn_browser(const std::string& url) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t defaults;
  sigemptyset(&defaults);
  for (const int signal : {SIGINT, SIGTERM, SIGPIPE}) sigaddset(&defaults, signal);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGDEF);
  // The shell ends at once and the browser becomes a child of init, so that no wait() is needed.
  std::string script = R"(xdg-open "$1" &)", shell = "sh", address = url;
  char option[] = "-c";
  char* const arguments[] = {shell.data(), option, script.data(), shell.data(), address.data(), nullptr};
  pid_t child = 0;
  if (posix_spawn(&child, "/bin/sh", &files, &attributes, arguments, environ) == 0)
    waitpid(child, nullptr, 0);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
}

}  // namespace

Browser::~Browser() {
  if (opener_.joinable()) opener_.join();
}

void Browser::open(const std::string& url) {
  if (opener_.joinable() || !has_desktop_session()) return;
  opener_ = guarded_thread([url] { spawn_browser(url); },
                           [&log = log_](const std::string& what) {
                             log.warning("server", fmt::format("cannot start the browser: {}", what));
                           });
}

}  // namespace doppel::app
