#include "app/print_stderr.h"

#include <unistd.h>

#include <cstdio>
#include <mutex>

namespace doppel::app {
namespace {

std::mutex mutex;
OutputWriter* present = nullptr;

void set_present(OutputWriter* writer) {
  const std::lock_guard lock(mutex);
  present = writer;
}

}  // namespace

void write_stderr(std::string_view text) {
  {
    const std::lock_guard lock(mutex);
    if (present != nullptr) return present->write(text);
  }
  std::fwrite(text.data(), 1, text.size(), stderr);
}

StderrWriter::StderrWriter() : writer_(STDERR_FILENO) {
  set_present(&writer_);
}

StderrWriter::~StderrWriter() {
  set_present(nullptr);
}

}  // namespace doppel::app
