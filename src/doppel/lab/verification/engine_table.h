#pragma once
// The supported engines as text, JSON and the tables of docs/engines.md: which are built here, their
// features, and their tolerances in the contract tests.

#include <string>

#include "doppel/export.h"

namespace doppel {

DOPPEL_API std::string engines_text();
DOPPEL_API std::string engines_json();
// The tables of docs/engines.md: engines that are built here, without information about this machine.
DOPPEL_API std::string engines_markdown();

}  // namespace doppel
