#pragma once
// Captures the log of Fast DDS, which would otherwise be printed to the terminal.

#include "doppel/core/thrown.h"
#include "doppel/ros2/participant.h"

namespace doppel::ros2::fast {

// From now on; the whole process has one log of Fast DDS.
void catch_log();
MiddlewareLog middleware_log();
// Adds an entry as if it were of Fast DDS.
void log_message(const std::string& text);

// For what Fast DDS' threads run: what it throws would end the process, and is a complaint instead.
template <class Work>
void with_logged_exceptions(const Work& work) {
  try {
    work();
  } catch (...) {
    log_message(thrown_text());
  }
}

}  // namespace doppel::ros2::fast
