#pragma once
// The folders of a user in which doppel keeps files of its own.

#include <filesystem>

#include "doppel/export.h"

namespace doppel {

// The folder of data that is kept from run to run and cannot be recomputed: $XDG_STATE_HOME/doppel, else
// ~/.local/state/doppel.
// Empty: the user has neither. Any thread.
DOPPEL_API std::filesystem::path state_folder();

}  // namespace doppel
