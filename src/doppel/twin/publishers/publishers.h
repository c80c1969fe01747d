#pragma once
// What a twin publishes of its world: /clock, contacts, objects and their surroundings.

#include "doppel/export.h"

namespace doppel {

class TwinCore;

// Adds them to the parts of the twin.
DOPPEL_API void add_publishers(TwinCore& core);

}  // namespace doppel
