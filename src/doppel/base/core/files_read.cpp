#include "doppel/base/core/files_read.h"

#include <utility>

namespace doppel {
namespace {

thread_local FilesRead* recorder = nullptr;

}  // namespace

FilesRead::Recording::Recording(FilesRead& files) : before_(std::exchange(recorder, &files)) {}
FilesRead::Recording::~Recording() {
  recorder = before_;
}

void FilesRead::note(const std::filesystem::path& file) {
  if (recorder == nullptr) return;
  const FileVersion version = FileVersion::of(file);
  const std::lock_guard lock(recorder->mutex_);
  // The first version stays: what was read then may differ from what is there now.
  if (recorder->files_.size() < kMaxFiles) recorder->files_.emplace(file, version);
}

std::map<std::filesystem::path, FileVersion> FilesRead::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(files_, {});
}

}  // namespace doppel
