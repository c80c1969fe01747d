#pragma once
// The suite of a machine, and the date by which waivers end.

#include <filesystem>
#include <string>

#include "doppel/export.h"
#include "doppel/validation/checks/subject.h"
#include "doppel/validation/checks/suite.h"

namespace doppel {

// The suite in `file`, or with an empty name that of the machine's package; the defaults where it has none.
// Throws InputError as load_suite does.
DOPPEL_API Suite suite_of(const Subject& subject, const std::filesystem::path& file);

// Throws InputError with the nearest name: `joint`, or a joint, link or frame of the suite, is not the
// machine's. Does nothing where there is no machine.
DOPPEL_API void check_names(const Subject& subject, const Suite& suite, const std::string& joint);

DOPPEL_API std::string today();  // "2026-11-28"

}  // namespace doppel
