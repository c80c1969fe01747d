#include "app/door.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "app/process.h"
#include "app/tell.h"
#include "doppel/core/guarded_thread.h"
#include "doppel/server/admission.h"

namespace doppel::app {
namespace {

ServerOptions server_options(const std::string& robot, const DoorOptions& options,
                             std::shared_ptr<AssetLibrary> assets) {
  ServerOptions out;
  out.name = "doppel " + robot;
  out.host = options.host;
  out.token = options.token;
  out.page_folder = root_folder() / "web" / "dist";
  out.assets = std::move(assets);
  if (options.port != 0) {
    out.port = static_cast<std::uint16_t>(options.port);
    out.any_free_port = false;
  }
  return out;
}

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

bool is_installed(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((std::filesystem::path(folder) / program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

bool somebody_sits_here() {
  return (is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")) && !is_set("SSH_CONNECTION") &&
         isatty(STDOUT_FILENO) != 0 && is_installed("xdg-open");
}

// In a session of its own, so that Ctrl-C here does not end the browser, without our files, and silent.
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
  // The shell ends at once and leaves the browser to init: nobody here has to wait for it.
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

void add_door_options(CLI::App& verb, DoorOptions& options) {
  verb.add_option("--port", options.port, "The server's port (else 8700 or the next that is free)")
      ->check(CLI::Range(1, 65535));
  verb.add_option("--host", options.host,
                  "The address to listen on; beyond 127.0.0.1 everybody who connects needs the token that "
                  "stands in the printed address");
  verb.add_option("--token", options.token,
                  "A token of your own, 16 characters or more, to be asked for (else one is made where "
                  "--host needs it)")
      ->check([](const std::string& token) {
        const Status usable = check_token(token);
        return usable ? std::string() : usable.why();
      });
  verb.add_flag("--no-open", options.no_open, "Do not open the page in the desktop's browser");
}

Door::Door(Bus& bus, const std::string& robot, const DoorOptions& options,
           std::shared_ptr<AssetLibrary> assets, const Log& log)
    : log_(log),
      open_(!options.no_open && somebody_sits_here()),
      server_(bus, server_options(robot, options, std::move(assets)), log),
      announcement_(robot, server_.port(), server_.own_address(), server_.token()) {
  if (announcement_.problem().empty()) return;
  log.warning(
      "server",
      fmt::format("other shells cannot find this twin by themselves: {}; name the port there, --port {}",
                  announcement_.problem(), server_.port()));
}

Door::~Door() {
  if (opener_.joinable()) opener_.join();
}

void Door::print() const {
  tell("  page         {}{}\n", server_.page_url(),
       server_.token().empty() ? "" : "  (whoever has this address can move the robot)");
  tell("  server       {}  (Foxglove WebSocket; from another shell: doppel topic list)\n", server_.url());
}

void Door::open_page() {
  if (!std::exchange(open_, false)) return;
  opener_ = guarded_thread([url = server_.page_url()] { spawn_browser(url); },
                           [&log = log_](const std::string& what) {
                             log.warning("server", fmt::format("the browser cannot be started: {}", what));
                           });
}

}  // namespace doppel::app
