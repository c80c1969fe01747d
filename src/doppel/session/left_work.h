#pragma once
// Work on a thread that may not be waited for when the process ends.

namespace doppel {

// A thread runs on that may not be waited for: the process is to end without cleaning up behind main.
void leave_work_behind();
bool work_left_behind();

}  // namespace doppel
