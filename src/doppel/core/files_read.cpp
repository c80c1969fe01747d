#include "doppel/core/files_read.h"

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
  const std::lock_guard lock(recorder->mutex_);
  if (recorder->files_.size() < kMaxFiles) recorder->files_.insert(file);
}

std::set<std::filesystem::path> FilesRead::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(files_, {});
}

}  // namespace doppel
