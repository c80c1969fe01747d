#pragma once
// A mutex for a thread that holds it again and again, as one that steps a twin does: between two of its
// turns a thread that waits gets it.

#include <mutex>

namespace doppel::python {

class FairMutex {
 public:
  // The thread that waits for `held_` has `turn_`, so that the one before it cannot come back first.
  void lock() {
    const std::lock_guard turn(turn_);
    held_.lock();
  }
  void unlock() { held_.unlock(); }

 private:
  std::mutex turn_, held_;
};

}  // namespace doppel::python
