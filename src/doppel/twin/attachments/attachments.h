#pragma once
// Attachments of links to each other, on request of a service or of a description's plugin, and
// /doppel/grasps, what the robots hold.

#include "doppel/export.h"

namespace doppel {

class TwinCore;

// Adds them to the parts of the twin.
DOPPEL_API void add_attachments(TwinCore& core);

}  // namespace doppel
