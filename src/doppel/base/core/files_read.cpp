#include "doppel/base/core/files_read.h"

#include <utility>

namespace doppel {
namespace {

thread_local const FilesRead::Recording* innermost_recording = nullptr;

}  // namespace

FilesRead::Recording::Recording(FilesRead& files)
    : files_(files), around_(std::exchange(innermost_recording, this)) {}
FilesRead::Recording::~Recording() {
  innermost_recording = around_;
}

void FilesRead::note(const std::filesystem::path& file) {
  if (innermost_recording == nullptr) return;
  const FileVersion version = FileVersion::of(file);
  for (const Recording* one = innermost_recording; one != nullptr; one = one->around_)
    one->files_.add(file, version);
}

void FilesRead::add(const std::filesystem::path& file, const FileVersion& version) {
  const std::lock_guard lock(mutex_);
  // The first version stays: what was read then may differ from what is there now.
  if (files_.size() < kMaxFiles) files_.emplace(file, version);
}

std::map<std::filesystem::path, FileVersion> FilesRead::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(files_, {});
}

}  // namespace doppel
