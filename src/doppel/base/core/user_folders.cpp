#include "doppel/base/core/user_folders.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace doppel {

namespace fs = std::filesystem;

fs::path state_folder() {
  const char* const state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && *state == '/') return fs::path(state) / "doppel";
  const char* const home = std::getenv("HOME");
  if (home != nullptr && *home == '/') return fs::path(home) / ".local" / "state" / "doppel";
  return {};
}

std::string private_folder_problem(const fs::path& folder) {
  struct stat facts {};
  if (lstat(folder.c_str(), &facts) != 0 || !S_ISDIR(facts.st_mode) || facts.st_uid != geteuid() ||
      (facts.st_mode & 077) != 0)
    return fmt::format("{} is not a folder that only this user can access", folder.string());
  return "";
}

std::string make_private_folder(const fs::path& folder) {
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
    return fmt::format("cannot create {}: {}", folder.string(), std::strerror(errno));
  return private_folder_problem(folder);
}

fs::path runtime_folder() {
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime != nullptr && *runtime == '/') return fs::path(runtime) / "doppel";
  return fmt::format("/tmp/doppel-{}", geteuid());
}

}  // namespace doppel
