#include "doppel/base/core/read_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <span>

#include "doppel/base/core/allowed_pipes.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/files_read.h"

namespace doppel {
namespace {

RegularFile not_open(std::string problem, bool is_missing = false) {
  RegularFile out;
  out.problem = std::move(problem);
  out.is_missing = is_missing;
  return out;
}
RegularFile failed_to_open() {
  return not_open(std::strerror(errno), errno == ENOENT || errno == ENOTDIR);
}

// Empty: it is a regular file.
std::string kind_problem(const struct stat& facts) {
  if (S_ISREG(facts.st_mode)) return "";
  return S_ISDIR(facts.st_mode) ? "it is a folder" : "it is not a regular file";
}

std::string size_text(std::size_t bytes) {
  constexpr std::size_t kMegabyte = std::size_t{1} << 20;
  return bytes % kMegabyte == 0 ? fmt::format("{} MB", bytes / kMegabyte) : fmt::format("{} bytes", bytes);
}

FileContent not_read(std::string problem, bool is_missing = false) {
  return {.bytes = {}, .problem = std::move(problem), .is_missing = is_missing};
}

// Reads a pipe of the user until its end. It is not opened by its name, as a named pipe whose writer has
// ended would wait for another one.
FileContent read_pipe(const std::filesystem::path& file, std::size_t max_bytes) {
  const int number = file == "/dev/stdin" ? STDIN_FILENO : std::atoi(file.filename().c_str());
  const FileDescriptor pipe(fcntl(number, F_DUPFD_CLOEXEC, 0));
  struct stat facts {};
  if (!pipe.is_open() || fstat(pipe.get(), &facts) != 0)
    return not_read(std::strerror(errno), errno == EBADF);
  if (!S_ISFIFO(facts.st_mode) && !S_ISREG(facts.st_mode)) return not_read("it is neither a file nor a pipe");
  FileContent out;
  std::array<char, 65536> part{};
  for (ssize_t count = 1; count > 0 && out.bytes.size() <= max_bytes;) {
    count = read_all(pipe.get(), std::as_writable_bytes(std::span(part)));
    if (count < 0) return not_read(std::strerror(errno));
    out.bytes.append(part.data(), static_cast<std::size_t>(count));
  }
  return out.bytes.size() > max_bytes ? not_read(fmt::format("it is larger than {}", size_text(max_bytes)))
                                      : out;
}

// A file is read again at a reload, and a pipe has its bytes only once, so that they are kept.
FileContent read_pipe_once(const std::filesystem::path& file, std::size_t max_bytes) {
  static std::mutex mutex;
  static std::map<std::filesystem::path, FileContent> contents;
  const std::lock_guard lock(mutex);
  const auto kept = contents.find(file);
  if (kept != contents.end()) return kept->second;
  return contents.emplace(file, read_pipe(file, max_bytes)).first->second;
}

// At most `count` bytes of what is open.
FileContent bytes_of(const RegularFile& file, std::size_t count) {
  FileContent out;
  out.bytes.resize(count);
  const ssize_t size = read_all(file.descriptor.get(), std::as_writable_bytes(std::span(out.bytes)));
  if (size < 0) return not_read(std::strerror(errno));
  out.bytes.resize(static_cast<std::size_t>(size));
  return out;
}

}  // namespace

RegularFile open_regular_file(const std::filesystem::path& file) {
  struct stat facts {};
  if (stat(file.c_str(), &facts) != 0) return failed_to_open();
  if (std::string problem = kind_problem(facts); !problem.empty()) return not_open(std::move(problem));
  // Another file may have its name since then: a pipe would wait for a writer.
  RegularFile out;
  out.descriptor = FileDescriptor(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (!out.descriptor.is_open() || fstat(out.descriptor.get(), &facts) != 0) return failed_to_open();
  if (std::string problem = kind_problem(facts); !problem.empty()) return not_open(std::move(problem));
  out.size = static_cast<std::uint64_t>(facts.st_size);
  return out;
}

FileContent read_content(const std::filesystem::path& file, std::size_t max_bytes) {
  if (is_allowed_pipe(file)) return read_pipe_once(file, max_bytes);
  const RegularFile opened = open_regular_file(file);
  if (!opened.problem.empty()) return not_read(opened.problem, opened.is_missing);
  if (opened.size > max_bytes) return not_read(fmt::format("it is larger than {}", size_text(max_bytes)));
  return bytes_of(opened, static_cast<std::size_t>(opened.size));
}

std::string beginning_of_file(const std::filesystem::path& file, std::size_t max_bytes) {
  const RegularFile opened = open_regular_file(file);
  if (!opened.problem.empty()) return "";
  return bytes_of(opened, static_cast<std::size_t>(std::min<std::uint64_t>(opened.size, max_bytes))).bytes;
}

std::string read_file(const std::string& file, std::size_t max_bytes) {
  FilesRead::note(file);
  FileContent content = read_content(file, max_bytes);
  if (content.was_read()) return std::move(content.bytes);
  throw InputError("file.unreadable", make_location(file),
                   fmt::format("'{}' cannot be read: {}", file, content.problem));
}

}  // namespace doppel
