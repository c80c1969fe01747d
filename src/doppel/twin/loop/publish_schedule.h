#pragma once
// The schedule of a topic that is published between steps: at a rate of simulated time, at once for a
// new subscriber, and at once after the state was written by a service, so that clients see it while
// time is paused.

#include "doppel/base/core/time.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API PublishSchedule {
 public:
  explicit PublishSchedule(Duration period) : period_(period) {}

  // Called at every step. True: publish now.
  bool operator()(Time now, bool has_listeners) {
    const bool due = has_listeners && (!had_listeners_ || at_once_ || now >= next_ || now < last_);
    had_listeners_ = has_listeners;
    last_ = now;
    if (!due) return false;
    at_once_ = false;
    next_ = now + period_;
    return true;
  }
  void at_once() { at_once_ = true; }

 private:
  const Duration period_;
  Time next_{}, last_{};
  bool had_listeners_ = false, at_once_ = false;
};

}  // namespace doppel
