#include "doppel/base/core/allowed_pipes.h"

#include <algorithm>
#include <vector>

namespace doppel {
namespace {

std::vector<std::filesystem::path>& allowed_pipes() {
  static std::vector<std::filesystem::path> pipes;
  return pipes;
}

}  // namespace

void allow_pipes(std::span<const std::string> arguments) {
  for (const std::string& argument : arguments) {
    const std::size_t begin = argument.find("/dev/");  // behind --option= or name:= too
    if (begin == std::string::npos) continue;
    const std::filesystem::path file = argument.substr(begin);
    if (file == "/dev/stdin" || file.parent_path() == "/dev/fd") allowed_pipes().push_back(file);
  }
}

bool is_allowed_pipe(const std::filesystem::path& file) {
  return std::ranges::find(allowed_pipes(), file) != allowed_pipes().end();
}

}  // namespace doppel
