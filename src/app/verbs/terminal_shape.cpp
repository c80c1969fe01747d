#include "app/verbs/terminal_shape.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

namespace doppel::app {
namespace {

constexpr int kPipedWidth = 100, kMinWidth = 40, kMaxWidth = 140;

}  // namespace

TerminalShape terminal_shape(const std::string& colour) {
  TerminalShape out;
  const bool terminal = isatty(STDOUT_FILENO) != 0;
  out.colour = colour == "always" || (colour == "auto" && terminal && std::getenv("NO_COLOR") == nullptr);
  winsize size{};
  const bool has_size = terminal && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  out.width = has_size ? std::clamp<int>(size.ws_col, kMinWidth, kMaxWidth) : kPipedWidth;
  if (const char* columns = std::getenv("COLUMNS"); !has_size && columns != nullptr) {
    if (const int number = std::atoi(columns); number > 0)
      out.width = std::clamp(number, kMinWidth, kMaxWidth);
  }
  return out;
}

}  // namespace doppel::app
