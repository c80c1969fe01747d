#include "doppel/review/audit/report_places.h"

#include <algorithm>
#include <cctype>

#include "doppel/base/core/shown_path.h"

namespace doppel {
namespace {

bool of_a_path(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
         std::string_view("/._-~").find(c) != std::string_view::npos;
}

}  // namespace

PathShortener::PathShortener(const std::filesystem::path& folder)
    : folder_(folder), prefix_(folder.has_relative_path() ? folder.string() + "/" : "") {}

std::string PathShortener::path(const std::string& path) const {
  return shown_path(path, folder_);
}

std::string PathShortener::text(std::string text) const {
  if (prefix_.empty()) return text;
  for (std::size_t at = text.find(prefix_); at != std::string::npos; at = text.find(prefix_, at)) {
    const std::size_t end = text.find(':', at);
    if (end == std::string::npos) break;
    const bool place = end + 1 < text.size() &&
                       std::isdigit(static_cast<unsigned char>(text[end + 1])) != 0 &&
                       text.find_first_of("'\"\n", at) >= end;
    if (place && (at == 0 || !of_a_path(text[at - 1])))
      text.erase(at, prefix_.size());
    else
      at += prefix_.size();
  }
  return text;
}

SourceLocation PathShortener::place(SourceLocation where) const {
  if (where.file) where.file = std::make_shared<const std::string>(path(*where.file));
  if (where.within) {
    where.within = std::make_shared<const SourceLocation::Within>(
        SourceLocation::Within{place(where.within->call), where.within->what});
  }
  return where;
}

void shorten_places(AuditReport& report, const std::filesystem::path& folder) {
  const PathShortener shortener(folder);
  for (Finding& finding : report.findings) shortener.shorten(finding);
  report.file = shortener.path(report.file.string());
}

InputError with_short_places(const InputError& error, const std::filesystem::path& folder) {
  const PathShortener shortener(folder);
  std::vector<Diagnostic> diagnostics = error.diagnostics();
  for (Diagnostic& diagnostic : diagnostics) shortener.shorten(diagnostic);
  return InputError(std::move(diagnostics));
}

std::vector<const SourceLocation::Within*> calls(const SourceLocation& where) {
  std::vector<const SourceLocation::Within*> out;
  for (const auto* w = where.within.get(); w != nullptr; w = w->call.within.get()) out.push_back(w);
  std::reverse(out.begin(), out.end());
  return out;
}

AuditReport refusal_report(const InputError& error, const std::filesystem::path& file) {
  AuditReport report;
  report.file = file;
  for (const Diagnostic& d : error.diagnostics()) {
    Finding finding;
    finding.rule = d.rule;
    finding.severity = d.severity;
    finding.message = d.message;
    finding.where = d.where.known() ? d.where : make_location(file.string());
    finding.fix = d.fix;
    report.findings.push_back(std::move(finding));
  }
  return report;
}

}  // namespace doppel
