#pragma once
// The files that a task tries to read, whether they exist or not: when the task fails, a change of one of
// them is the reason to repeat it, also of a file that the task did not read before. Each is recorded with its
// version before it is read, so that a change while the task runs is seen as well.

#include <filesystem>
#include <map>
#include <mutex>

#include "doppel/base/core/file_version.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API FilesRead {
 public:
  // While it exists, what its thread tries to read is recorded, also by the recordings around it.
  class DOPPEL_API Recording {
   public:
    explicit Recording(FilesRead& files);
    ~Recording();
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

   private:
    friend class FilesRead;
    FilesRead& files_;
    const Recording* const around_;
  };

  // Called by those who read or look for files of the user, before they do.
  static void note(const std::filesystem::path& file);
  // The files recorded since the last call. Any thread.
  [[nodiscard]] std::map<std::filesystem::path, FileVersion> take();

 private:
  void add(const std::filesystem::path& file, const FileVersion& version);

  static constexpr std::size_t kMaxFiles = 10'000;
  std::mutex mutex_;
  std::map<std::filesystem::path, FileVersion> files_;
};

}  // namespace doppel
