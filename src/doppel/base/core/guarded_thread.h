#pragma once
// A thread that catches all exceptions, because one that leaves a thread ends the process.

#include <string>
#include <thread>
#include <utility>

#include "doppel/base/core/thrown.h"

namespace doppel {

// An exception of `work` ends the thread, after `report` was called with its text on that thread. `report`
// must not throw. Throws std::system_error if the thread cannot be started.
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
