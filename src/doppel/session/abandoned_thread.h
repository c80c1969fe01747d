#pragma once
// Work on a thread that may not be waited for when the process ends.

#include "doppel/export.h"

namespace doppel {

// A thread runs on that may not be waited for: the process is to end without cleaning up behind main.
DOPPEL_API void mark_thread_abandoned();
DOPPEL_API bool has_abandoned_thread();

}  // namespace doppel
