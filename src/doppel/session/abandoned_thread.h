#pragma once
// Work on a thread that may not be waited for when the process ends.

namespace doppel {

// A thread runs on that may not be waited for: the process is to end without cleaning up behind main.
void mark_thread_abandoned();
bool has_abandoned_thread();

}  // namespace doppel
