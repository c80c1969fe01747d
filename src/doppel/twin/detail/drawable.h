#pragma once
// What a picture can do without, beyond what every reader leaves out.

#include "doppel/core/diagnostic.h"

namespace doppel {

// Errors in `found` that a picture can do without (an unknown type of joint) become warnings in `told`, which
// say what it shows instead; the rest of `found` goes there as it is. Throws InputError with the errors of
// `found` that leave nothing to draw (no tree, numbers that cannot be read, no names).
void make_drawable(const Diagnostics& found, Diagnostics& out);

}  // namespace doppel
