#include "app/start_check.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <iterator>
#include <string_view>

#include "doppel/base/core/file_descriptor.h"

namespace doppel::app {
namespace {

// The list, with a NUL behind each path; empty: it cannot be read.
std::string read_list(int folder, Part part) {
  const char* const path = part == Part::twin ? "build/.twin-built" : "build/.doppel-built";
  const FileDescriptor file(openat(folder, path, O_RDONLY | O_CLOEXEC));
  struct stat status {};
  if (!file.is_open() || fstat(file.get(), &status) != 0) return {};
  std::string out(static_cast<std::size_t>(status.st_size), '\0');
  const ssize_t got = read_all(file.get(), std::as_writable_bytes(std::span(out)));
  if (got <= 0 || out.back() != '\n') return {};
  return out;
}

// "1763787185.1234567890": find's notation, to the nanosecond.
bool parse_time(const char* begin, const char* end, timespec& out) {
  const auto [point, bad] = std::from_chars(begin, end, out.tv_sec);
  if (bad != std::errc{} || point == end || *point != '.' || end - point < 10) return false;
  return std::from_chars(point + 1, point + 10, out.tv_nsec).ec == std::errc{};
}

// True if doppel-start is built from it: the modules that it links, the command line, and the build files.
bool makes_xacro(std::string_view path) {
  if (!path.starts_with("src/")) return !path.starts_with("web/");
  path.remove_prefix(4);
  if (path.starts_with("app")) return true;
  if (!path.starts_with("doppel/")) return true;
  path.remove_prefix(7);
  const std::string_view module = path.substr(0, path.find('/', path.find('/') + 1));
  const bool aside =
      path.find("/test/") != std::string_view::npos || path.find("/fuzz/") != std::string_view::npos;
  constexpr std::string_view kModules[] = {"base/core", "base/math",         "base/packages",
                                           "base/xml",  "description/xacro", "description/urdf"};
  return std::find(std::begin(kModules), std::end(kModules), module) != std::end(kModules) && !aside;
}

}  // namespace

Part part_for(std::string_view verb) {
  if (verb == "up" || verb == "view") return Part::twin;
  return verb == "xacro" ? Part::xacro : Part::all;
}

bool must_build(const std::string& root, Part part) {
  const FileDescriptor folder(open(root.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  if (!folder.is_open() || faccessat(folder.get(), "build/bin/doppel", X_OK, 0) != 0) return true;
  std::string list = read_list(folder.get(), part);
  if (list.empty()) return true;
  for (char *at = list.data(), *const end = at + list.size(); at != end;) {
    char* const line_end = static_cast<char*>(std::memchr(at, '\n', static_cast<std::size_t>(end - at)));
    char* const blank = static_cast<char*>(std::memchr(at, ' ', static_cast<std::size_t>(line_end - at)));
    timespec then{};
    if (blank == nullptr || !parse_time(at, blank, then)) return true;
    *line_end = '\0';
    struct stat now {};
    const std::string_view path(blank + 1, static_cast<std::size_t>(line_end - blank - 1));
    if (part == Part::xacro && !makes_xacro(path)) {
      at = line_end + 1;
      continue;
    }
    if (fstatat(folder.get(), blank + 1, &now, 0) != 0 || now.st_mtim.tv_sec != then.tv_sec ||
        now.st_mtim.tv_nsec != then.tv_nsec)
      return true;
    at = line_end + 1;
  }
  return false;
}

int build(const std::string& root, Part part) {
  const std::string tool = root + "/tools/build";
  const pid_t child = fork();
  if (child == 0) {
    dup2(STDERR_FILENO, STDOUT_FILENO);
    const char* const what = part == Part::twin ? "twin" : "doppel";
    execl(tool.c_str(), tool.c_str(), what, static_cast<char*>(nullptr));
    _exit(127);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) < 0) return 1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace doppel::app
