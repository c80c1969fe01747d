#include "doppel/description/scaffold/write_package.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/output_file.h"
#include "doppel/base/core/shown_path.h"

namespace doppel::scaffold {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& folder, int reason) {
  if (reason == EEXIST || reason == ENOTEMPTY) {
    throw InputError("new.exists", make_location(shown_path(folder)), "something of that name exists already",
                     "choose another name, or another folder with --in");
  }
  std::string remedy = "choose another folder with --in";
  // A file system without new folders, as /proc, reports the same for a folder that exists.
  std::error_code unknown;
  if (reason == ENOENT && !fs::exists(folder.parent_path(), unknown))
    remedy = fmt::format("make the folder first: mkdir -p '{}'", folder.parent_path().string());
  if (reason == ENOSPC || reason == EDQUOT) remedy = "make room on the disk; nothing has been written";
  throw InputError("new.unwritable", make_location(shown_path(folder)),
                   fmt::format("the package cannot be written: {}", std::strerror(reason)), remedy);
}

// A hidden folder beside the package's place, which is removed unless it is moved there.
class DraftFolder {
 public:
  explicit DraftFolder(const fs::path& folder)
      : folder_(folder),
        name_((folder.parent_path() / ("." + folder.filename().string() + ".XXXXXX")).string()) {
    if (mkdtemp(name_.data()) == nullptr) refuse(folder_, errno);
  }
  DraftFolder(const DraftFolder&) = delete;
  DraftFolder& operator=(const DraftFolder&) = delete;
  ~DraftFolder() {
    std::error_code ignored;
    if (!moved_) fs::remove_all(name_, ignored);
  }

  [[nodiscard]] fs::path path() const { return name_; }

  void move_into_place() {
    const mode_t mask = umask(0);
    umask(mask);
    if (chmod(name_.c_str(), 0777 & ~mask) != 0) refuse(folder_, errno);
    // rename() replaces an empty folder that another process has made meanwhile, which loses no data.
    if (rename(name_.c_str(), folder_.c_str()) != 0) refuse(folder_, errno);
    moved_ = true;
  }

 private:
  fs::path folder_;
  std::string name_;
  bool moved_ = false;
};

}  // namespace

void write_package(const fs::path& folder, std::span<const PackageFile> files) {
  std::error_code failed;
  if (fs::exists(fs::symlink_status(folder, failed))) refuse(folder, EEXIST);
  DraftFolder draft(fs::absolute(folder));
  for (const PackageFile& file : files) {
    const fs::path path = draft.path() / file.path;
    fs::create_directories(path.parent_path(), failed);
    if (failed) refuse(folder, failed.value());
    try {
      write_whole(path, file.text);
    } catch (const InputError& error) {  // rethrown with the requested path
      const Diagnostic& reason = error.diagnostics().front();
      throw InputError("new.unwritable", make_location(shown_path(folder / file.path)), reason.message,
                       reason.fix);
    }
  }
  draft.move_into_place();
}

}  // namespace doppel::scaffold
