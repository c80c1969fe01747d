#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "doppel/base/core/child_process.h"
#include "doppel/review/doctor/detail/probes.h"

namespace doppel::doctor {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBrowsers[] = {"firefox", "firefox-esr",    "chromium", "google-chrome",
                                     "brave",   "microsoft-edge", "epiphany", "falkon"};

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

void add_node(const fs::path& node, DisplayFacts& facts) {
  const bool usable = access(node.c_str(), R_OK | W_OK) == 0;
  (usable ? facts.render_nodes : facts.forbidden_render_nodes).push_back(node.string());
}

}  // namespace

DisplayFacts probe_display() {
  DisplayFacts facts;
  facts.has_display = is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
  facts.is_ssh = is_set("SSH_CONNECTION");
  facts.has_terminal = isatty(STDOUT_FILENO) != 0;
  facts.has_xdg_open = !find_program("xdg-open").empty();
  for (const char* browser : kBrowsers) {
    if (!find_program(browser).empty()) facts.browsers.emplace_back(browser);
  }
  std::error_code none;
  for (const auto& entry : fs::directory_iterator("/dev/dri", none)) {
    if (entry.path().filename().string().starts_with("renderD")) add_node(entry.path(), facts);
  }
  for (const char* node : {"/dev/nvidia0", "/dev/dxg"}) {
    if (fs::exists(node, none)) add_node(node, facts);
  }
  std::ranges::sort(facts.render_nodes);
  facts.is_wsl = fs::exists("/dev/dxg", none) || is_set("WSL_DISTRO_NAME");
  return facts;
}

}  // namespace doppel::doctor
