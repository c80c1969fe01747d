#pragma once
// When something that is published between steps is due: at a rate of simulated time, at once for who begins
// to listen, and after the state was written from outside, so that pictures follow while time stands.

#include "doppel/core/time.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API PublishSchedule {
 public:
  explicit PublishSchedule(Duration period) : period_(period) {}

  // Ask at every step; `heard`: somebody listens. True: publish now.
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
