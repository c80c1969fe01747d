#pragma once
// A report's places as the reader would write them, and a report of what was refused.

#include <filesystem>
#include <vector>

#include "doppel/audit/audit.h"
#include "doppel/export.h"

namespace doppel {

// Paths below the folder become relative to it, in places and in messages, whoever named them: the user, or
// an <include> through its package.
DOPPEL_API void shorten_places(AuditReport& report, const std::filesystem::path& folder);
DOPPEL_API InputError with_short_places(const InputError& error, const std::filesystem::path& folder);

// The expansions around a place, outermost first; the place itself is not among them. They live as long as
// `where` does.
DOPPEL_API std::vector<const SourceLocation::Within*> calls(const SourceLocation& where);

// For readers of --json and the like: a description that there is nothing to judge of, with what was refused.
DOPPEL_API AuditReport refusal_report(const InputError& error, const std::filesystem::path& file);

}  // namespace doppel
