#include "doppel/base/core/diagnostic.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace doppel {
namespace {

std::string joined(const std::vector<Diagnostic>& diagnostics) {
  std::string out;
  for (const Diagnostic& d : diagnostics) {
    if (!out.empty()) out += '\n';
    out += d.str();
  }
  return out;
}

}  // namespace

std::string_view to_string(Severity severity) {
  switch (severity) {
    case Severity::note:
      return "note";
    case Severity::warning:
      return "warning";
    case Severity::error:
      return "error";
  }
  return "error";
}

std::string Diagnostic::str() const {
  std::string out = where.known() ? where.str() + ": " : "";
  out += fmt::format("{}: {}", to_string(severity), message);
  if (!rule.empty()) out += fmt::format(" [{}]", rule);
  if (!fix.empty()) out += fmt::format("\n  fix: {}", fix);
  return out;
}

void Diagnostics::add(Diagnostic diagnostic) {
  all_.push_back(std::move(diagnostic));
}

void Diagnostics::error(std::string rule, SourceLocation where, std::string message, std::string fix) {
  add({Severity::error, std::move(rule), std::move(message), std::move(where), std::move(fix)});
}

void Diagnostics::warning(std::string rule, SourceLocation where, std::string message, std::string fix) {
  add({Severity::warning, std::move(rule), std::move(message), std::move(where), std::move(fix)});
}

void Diagnostics::note(std::string rule, SourceLocation where, std::string message, std::string fix) {
  add({Severity::note, std::move(rule), std::move(message), std::move(where), std::move(fix)});
}

std::size_t Diagnostics::count(Severity severity) const {
  return static_cast<std::size_t>(
      std::count_if(all_.begin(), all_.end(), [&](const Diagnostic& d) { return d.severity == severity; }));
}

std::vector<Diagnostic> condensed(const Diagnostics& diagnostics, std::size_t most) {
  using Kind = std::pair<std::string_view, Severity>;  // the rule
  std::map<std::pair<Kind, std::string_view>, std::size_t> places;
  for (const Diagnostic& d : diagnostics.all()) ++places[{{d.rule, d.severity}, d.message}];
  std::map<Kind, std::size_t> messages;
  for (const auto& [text, count] : places) ++messages[text.first];
  std::map<Kind, std::size_t> shown;
  std::vector<Diagnostic> out;
  for (const Diagnostic& d : diagnostics.all()) {
    const Kind kind{d.rule, d.severity};
    const std::size_t count = std::exchange(places[{kind, d.message}], 0);
    if (count == 0) continue;
    const std::size_t of_rule = messages[kind], before = shown[kind]++;
    const bool is_limited = d.severity != Severity::error && of_rule > most + 1;
    if (is_limited && before > most) continue;
    out.push_back(d);
    if (is_limited && before == most) {
      out.back().where = {};
      out.back().message = fmt::format("{} more {}s of this kind; 'doppel check' lists them", of_rule - most,
                                       to_string(d.severity));
      out.back().fix.clear();
    } else if (count > 1) {
      out.back().message = fmt::format("at {} places: {}", count, d.message);
    }
  }
  return out;
}

void Diagnostics::throw_if_errors() const {
  std::vector<Diagnostic> errors;
  std::copy_if(all_.begin(), all_.end(), std::back_inserter(errors),
               [](const Diagnostic& d) { return d.severity == Severity::error; });
  if (!errors.empty()) throw InputError(std::move(errors));
}

InputError::InputError(Diagnostic diagnostic) : InputError(std::vector<Diagnostic>{std::move(diagnostic)}) {}

InputError::InputError(std::vector<Diagnostic> diagnostics)
    : std::runtime_error(joined(diagnostics)), diagnostics_(std::move(diagnostics)) {}

InputError::InputError(std::string rule, SourceLocation where, std::string message, std::string fix)
    : InputError(Diagnostic{Severity::error, std::move(rule), std::move(message), std::move(where),
                            std::move(fix)}) {}

}  // namespace doppel
