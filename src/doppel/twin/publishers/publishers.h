#pragma once
// The publishers of a twin's world: /clock, contacts, objects and their surroundings.

#include "doppel/export.h"

namespace doppel {

class TwinCore;

// Adds them to the parts of the twin.
DOPPEL_API void add_publishers(TwinCore& core);

}  // namespace doppel
