#pragma once
// A suite file to begin with.

#include <string>

#include "doppel/export.h"
#include "doppel/validation/checks/subject.h"

namespace doppel {

// Every key with its default and a comment; those that depend on the machine (workspace, tool, poses) with
// its names and its reach, as comments. Precondition: no refusal.
DOPPEL_API std::string suite_template(const Subject& subject);

}  // namespace doppel
