#pragma once
// A thread whose root lets nothing out: an exception that leaves a thread ends the process.

#include <string>
#include <thread>
#include <utility>

#include "doppel/core/thrown.h"

namespace doppel {

// What `work` throws ends the thread, after `report` has had it as text, on that thread. `report` must not
// throw.
template <class Work, class Report>
std::thread guarded_thread(Work work, Report report) {
  return std::thread([work = std::move(work), report = std::move(report)]() mutable {
    try {
      work();
    } catch (...) {
      report(thrown_text());
    }
  });
}

}  // namespace doppel
