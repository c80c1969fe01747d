#pragma once
// Captures the log of Fast DDS, which would otherwise be printed to the terminal.

#include "doppel/base/core/thrown.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2::fast {

// From now on; the whole process has one log of Fast DDS.
void catch_log();
MiddlewareLog middleware_log();
// Adds an entry to the captured log of Fast DDS.
void log_message(const std::string& text);

// For callbacks on threads of Fast DDS: an exception would end the process, so it is logged instead.
template <class Work>
void with_logged_exceptions(const Work& work) {
  try {
    work();
  } catch (...) {
    log_message(thrown_text());
  }
}

}  // namespace doppel::ros2::fast
