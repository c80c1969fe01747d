#include "doppel/base/core/user_folders.h"

#include <cstdlib>

namespace doppel {

std::filesystem::path state_folder() {
  const char* const state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && *state == '/') return std::filesystem::path(state) / "doppel";
  const char* const home = std::getenv("HOME");
  if (home != nullptr && *home == '/') return std::filesystem::path(home) / ".local" / "state" / "doppel";
  return {};
}

}  // namespace doppel
