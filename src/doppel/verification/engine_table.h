#pragma once
// The engines that doppel knows as text, JSON and the tables of docs/engines.md: which are built here, what
// each of them can, and how far each may be from closed forms (the contract tests).

#include <string>

#include "doppel/export.h"

namespace doppel {

DOPPEL_API std::string engines_text();
DOPPEL_API std::string engines_json();
// Of those that are built here, without what a machine lacks: what docs/engines.md contains.
DOPPEL_API std::string engines_markdown();

}  // namespace doppel
