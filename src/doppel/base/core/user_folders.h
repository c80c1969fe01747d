#pragma once
// The folders of a user in which doppel keeps files of its own.

#include <filesystem>
#include <string>

#include "doppel/export.h"

namespace doppel {

// The folder of data that is kept from run to run and cannot be recomputed: $XDG_STATE_HOME/doppel, else
// ~/.local/state/doppel.
// Empty: the user has neither. Any thread.
DOPPEL_API std::filesystem::path state_folder();

// The folder by which running programs of the user find each other: $XDG_RUNTIME_DIR/doppel, else
// /tmp/doppel-<uid>. Any thread.
DOPPEL_API std::filesystem::path runtime_folder();
// Why other users may have put something into the folder, or may read it; "": this user alone can. A user
// who makes a folder in /tmp first can replace what is in it by links to files of the one who uses it. Any
// thread.
[[nodiscard]] DOPPEL_API std::string private_folder_problem(const std::filesystem::path& folder);
// The same for a folder that is made if it is not there, within one that is.
[[nodiscard]] DOPPEL_API std::string make_private_folder(const std::filesystem::path& folder);

}  // namespace doppel
