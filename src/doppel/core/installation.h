#pragma once
// Where doppel's own files are: the data that comes with it and the plugin modules. Both are found from the
// place of the library (or of the program that contains it), in an installation as in a checkout.

#include <filesystem>

#include "doppel/export.h"

namespace doppel {

// The folder of robots/, worlds/ and datasheets/: DOPPEL_ROOT where it is set, else share/doppel of the
// installation, else the checkout. Empty where none of them is there.
DOPPEL_API std::filesystem::path data_folder();

// The page's files: page/ of an installation, web/dist of a checkout.
DOPPEL_API std::filesystem::path page_folder();

// The folder of the plugin modules: lib/doppel of DOPPEL_ROOT where it is there, else the folder `doppel`
// beside the library.
DOPPEL_API std::filesystem::path plugin_module_folder();

}  // namespace doppel
