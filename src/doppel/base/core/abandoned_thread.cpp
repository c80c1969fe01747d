#include "doppel/base/core/abandoned_thread.h"

#include <atomic>

namespace doppel {
namespace {

std::atomic<bool> left_behind{false};

}  // namespace

void mark_thread_abandoned() {
  left_behind = true;
}

bool has_abandoned_thread() {
  return left_behind;
}

}  // namespace doppel
