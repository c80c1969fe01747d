#pragma once
// The places of doppel's own files: data and plugin modules. Both are found relative to the library (or to
// the program that contains it), in an installation as in a checkout. Any thread.

#include <filesystem>

#include "doppel/export.h"

namespace doppel {

// The folder of robots/, worlds/ and datasheets/: DOPPEL_ROOT if it is set, else share/doppel of the
// installation, else the checkout. Empty if none of them exists.
DOPPEL_API std::filesystem::path data_folder();

// The page's files: page/ of an installation, web/dist of a checkout.
DOPPEL_API std::filesystem::path page_folder();

// The folder of the plugin modules: lib/doppel of DOPPEL_ROOT if it exists, else the folder `doppel` next
// to the library.
DOPPEL_API std::filesystem::path plugin_module_folder();

}  // namespace doppel
