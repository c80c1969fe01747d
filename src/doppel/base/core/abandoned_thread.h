#pragma once
// Threads that are not joined when the process ends.

#include "doppel/export.h"

namespace doppel {

// Marks that a thread is still running and not joined, so that the process has to end without running static
// destructors. Any thread.
DOPPEL_API void mark_thread_abandoned();
DOPPEL_API bool has_abandoned_thread();

}  // namespace doppel
