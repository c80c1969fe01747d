#pragma once
// Errors of a description that do not prevent a picture.

#include "doppel/base/core/diagnostic.h"

namespace doppel {

// Errors in `found` that do not prevent a picture (an unknown joint type) become warnings in `out`, with
// what is drawn instead; other warnings and notes are copied. Throws InputError with the errors of `found`
// that do prevent it (no tree, invalid numbers, missing names).
void make_drawable(const Diagnostics& found, Diagnostics& out);

}  // namespace doppel
