#pragma once
// Relative paths in the places of a report, and the report of a rejected description.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/review/audit/audit.h"

namespace doppel {

class DOPPEL_API PathShortener {
 public:
  explicit PathShortener(const std::filesystem::path& folder);

  [[nodiscard]] std::string path(const std::string& path) const;
  // Shortens every place below the folder in the text, such as "(at /home/me/arm.urdf:2:1)"; quotations from
  // the description stay.
  [[nodiscard]] std::string text(std::string text) const;
  [[nodiscard]] SourceLocation place(SourceLocation where) const;

  // An item has a message, a fix and a place.
  template <class Item>
  void shorten(Item& item) const {
    item.message = text(std::move(item.message));
    item.fix = text(std::move(item.fix));
    item.where = place(std::move(item.where));
  }

 private:
  std::filesystem::path folder_;
  std::string prefix_;  // empty: the root, which shortens no path
};

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
