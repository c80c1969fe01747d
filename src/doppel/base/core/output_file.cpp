#include "doppel/base/core/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstring>
#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/file_descriptor.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& file, int reason) {
  std::string fix = "choose another location";
  std::error_code none;
  if (reason == ENOENT && file.is_relative() && fs::current_path(none).empty()) {
    fix = "change to a folder that exists: the working directory does not exist any more";
  } else if (reason == ENOENT) {
    fix = fmt::format("create the folder '{}' first", file.parent_path().string());
  }
  if (reason == ENOSPC || reason == EDQUOT) fix = "free disk space; the previous file is unchanged";
  if (reason == EFBIG) fix = "permit larger files: ulimit -f unlimited";
  if (reason == ENAMETOOLONG) fix = "choose a shorter name";
  if (reason == ELOOP) fix = "the links lead in a circle; give the path of a file";
  if (reason == EISDIR) fix = "give the path of a file";
  throw InputError("output.unwritable", make_location(file.string()),
                   fmt::format("cannot write the file: {}", std::strerror(reason)), fix);
}

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

// The start of a temporary file's name, short enough that an ending fits behind it.
std::string beside(const fs::path& file) {
  constexpr std::size_t kStart = NAME_MAX - 32;
  return (folder_of(file) / file.filename().native().substr(0, kStart)).string();
}

// The new content beside the file. It has no name until it is complete where the file system permits that, so that nothing
// stays of a process that is killed while it writes; else it is removed by the destructor.
class TemporaryFile {
 public:
  explicit TemporaryFile(const fs::path& file) : file_(file), name_(beside(file) + ".XXXXXX") {
    const fs::path folder = folder_of(file);
    if (access("/proc/self/fd", X_OK) == 0)  // by which it gets its name
      descriptor_ = open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
    if (descriptor_ >= 0) return;
    descriptor_ = mkstemp(name_.data());
    if (descriptor_ < 0) refuse(file_, errno);
    named_ = true;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (descriptor_ >= 0) close(descriptor_);
    if (named_) unlink(name_.c_str());
  }

  void write(std::string_view content) {
    if (!write_all(descriptor_, content)) refuse(file_, errno);
  }

  void put_in_place() {
    const mode_t mask = umask(0);
    umask(mask);
    struct stat old {};
    const mode_t mode = stat(file_.c_str(), &old) == 0 ? old.st_mode & 07777 : 0666 & ~mask;
    if (fchmod(descriptor_, mode) != 0 || fsync(descriptor_) != 0) refuse(file_, errno);
    if (!named_) give_name();
    const int descriptor = descriptor_;
    descriptor_ = -1;
    if (close(descriptor) != 0 || rename(name_.c_str(), file_.c_str()) != 0) refuse(file_, errno);
    named_ = false;
  }

 private:
  void give_name() {
    const std::string opened = fmt::format("/proc/self/fd/{}", descriptor_);
    for (unsigned i = 0; i < kMostNames; ++i) {
      name_ = fmt::format("{}.{}_{}", beside(file_), getpid(), i);
      named_ = linkat(AT_FDCWD, opened.c_str(), AT_FDCWD, name_.c_str(), AT_SYMLINK_FOLLOW) == 0;
      if (named_) return;
      if (errno != EEXIST) refuse(file_, errno);
    }
    refuse(file_, EEXIST);
  }

  static constexpr unsigned kMostNames = 1000;  // of other threads that write the same file at the moment
  fs::path file_;
  std::string name_;
  int descriptor_ = -1;
  bool named_ = false;
};

// False: /dev/stdout, /dev/full, a pipe: there is no old content to keep.
bool is_replaceable(const fs::path& file) {
  std::error_code none;
  if (file.filename().empty() || fs::is_directory(file, none)) refuse(file, EISDIR);
  return !fs::exists(file, none) || fs::is_regular_file(file, none);
}

// The file that a link leads to; it does not have to exist.
fs::path behind_link(const fs::path& file) {
  constexpr int kMostLinks = 40;  // as Linux follows
  fs::path at = file;
  std::error_code error;
  for (int links = 0; fs::is_symlink(at, error); ++links) {
    if (links == kMostLinks) refuse(file, ELOOP);
    const fs::path target = fs::read_symlink(at, error);
    if (error) refuse(file, error.value());
    at = folder_of(at) / target;
  }
  return at;
}

}  // namespace

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

void check_writable(const fs::path& file) {
  if (!is_replaceable(file)) {
    if (access(file.c_str(), W_OK) != 0) refuse(file, errno);
    return;
  }
  const fs::path target = behind_link(file), folder = folder_of(target);
  if (target.filename().native().size() > NAME_MAX) refuse(target, ENAMETOOLONG);
  std::error_code none;
  if (fs::exists(folder, none) && !fs::is_directory(folder, none)) refuse(target, ENOTDIR);
  if (access(folder.c_str(), W_OK | X_OK) != 0) refuse(target, errno);
}

void write_whole(const fs::path& file, std::string_view content) {
  if (!is_replaceable(file)) {
    const int descriptor = open(file.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) refuse(file, errno);
    const FileDescriptor opened(descriptor);
    if (!write_all(descriptor, content)) refuse(file, errno);
    return;
  }
  TemporaryFile temporary(behind_link(file));
  temporary.write(content);
  temporary.put_in_place();
}

}  // namespace doppel
