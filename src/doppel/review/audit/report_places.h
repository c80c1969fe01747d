#pragma once
// Relative paths in the places of a report, and the report of a rejected description.

#include <filesystem>
#include <vector>

#include "doppel/export.h"
#include "doppel/review/audit/audit.h"

namespace doppel {

// Makes paths below the folder relative to it, in places and in messages, from the user as well as from an
// <include> through a package.
DOPPEL_API void shorten_places(AuditReport& report, const std::filesystem::path& folder);
DOPPEL_API InputError with_short_places(const InputError& error, const std::filesystem::path& folder);

// The expansions around a place, outermost first, without the place itself. Valid as long as `where`.
DOPPEL_API std::vector<const SourceLocation::Within*> calls(const SourceLocation& where);

// The report of a description that cannot be audited, with the errors as findings, for --json
// and similar formats.
DOPPEL_API AuditReport refusal_report(const InputError& error, const std::filesystem::path& file);

}  // namespace doppel
