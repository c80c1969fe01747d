#include <fmt/format.h>
#include <fmt/ranges.h>

#include "doppel/review/doctor/findings.h"

namespace doppel::doctor {
namespace {

Finding judge_gpu(const DisplayFacts& facts) {
  if (!facts.render_nodes.empty()) {
    return {
        Level::ok, "display",
        "gpu",     fmt::format("the browser can render on the GPU ({})", fmt::join(facts.render_nodes, ", ")),
        "",        ""};
  }
  if (!facts.forbidden_render_nodes.empty()) {
    return {Level::note,
            "display",
            "gpu",
            fmt::format("{} may not be used by this user", fmt::join(facts.forbidden_render_nodes, ", ")),
            "the browser draws the page with the processor, which takes time from the twin",
            "usermod -aG render,video $USER, and log in again"};
  }
  return {Level::note,
          "display",
          "gpu",
          "no GPU is visible (no /dev/dri/renderD*)",
          "a browser on this machine draws the page with the processor, which takes time from the twin",
          "open the page from another machine (--host 0.0.0.0), or add ?quality=low to its address"};
}

Finding judge_browser(const DisplayFacts& facts) {
  const std::string found =
      facts.browsers.empty() ? "no browser in PATH" : fmt::format("{}", fmt::join(facts.browsers, ", "));
  if (facts.is_ssh) {
    return {Level::note,
            "display",
            "browser",
            "this is an SSH session",
            "no browser is opened here",
            "ssh -L 8700:127.0.0.1:8700 HOST, and open http://127.0.0.1:8700 there"};
  }
  if (!facts.has_display) {
    return {Level::note,
            "display",
            "browser",
            fmt::format("no desktop (neither DISPLAY nor WAYLAND_DISPLAY); {}", found),
            "no browser is opened; the page is served all the same",
            "open it from another machine: doppel up --host 0.0.0.0"};
  }
  if (facts.browsers.empty() && !facts.is_wsl) {
    return {Level::note,
            "display",
            "browser",
            found,
            "the page has to be opened elsewhere",
            "apt install firefox-esr"};
  }
  if (!facts.has_xdg_open) {
    return {Level::note,
            "display",
            "browser",
            found + "; xdg-open is missing",
            "the page does not open by itself",
            "apt install xdg-utils, or open the address that `doppel up` prints"};
  }
  return {Level::ok, "display", "browser", found, "", ""};
}

}  // namespace

std::vector<Finding> judge_display(const DisplayFacts& facts) {
  return {judge_gpu(facts), judge_browser(facts)};
}

}  // namespace doppel::doctor
