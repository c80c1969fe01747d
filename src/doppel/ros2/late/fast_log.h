#pragma once
// What Fast DDS has to say, kept from the terminal.

#include "doppel/core/thrown.h"
#include "doppel/ros2/participant.h"

namespace doppel::ros2::fast {

// From now on; the whole process has one log of Fast DDS.
void catch_log();
Complaints complaints();
// As if Fast DDS had said it.
void complain(const std::string& text);

// For what Fast DDS' threads run: what it throws would end the process, and is a complaint instead.
template <class Work>
void with_complaints(const Work& work) {
  try {
    work();
  } catch (...) {
    complain(thrown_text());
  }
}

}  // namespace doppel::ros2::fast
