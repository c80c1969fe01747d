#include "doppel/session/left_work.h"

#include <atomic>

namespace doppel {
namespace {

std::atomic<bool> left_behind{false};

}  // namespace

void leave_work_behind() {
  left_behind = true;
}

bool work_left_behind() {
  return left_behind;
}

}  // namespace doppel
