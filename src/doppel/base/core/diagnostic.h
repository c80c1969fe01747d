#pragma once
// Messages about the user's input. Parsers collect them in a Diagnostics; the caller prints them, publishes
// them as JSON or stops. A function that cannot continue with invalid input throws InputError, which main()
// turns into exit code 2.

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/export.h"

namespace doppel {

enum class Severity { note, warning, error };

DOPPEL_API std::string_view to_string(Severity severity);

struct DOPPEL_API Diagnostic {
  Severity severity = Severity::error;
  std::string rule;     // stable id, dotted: "urdf.two_roots"
  std::string message;  // what is wrong and why it matters
  SourceLocation where;
  std::string fix;  // what to do about it; may be empty

  // "arm.urdf:12:3: error: <message> [urdf.two_roots]\n  fix: ..." in one string.
  [[nodiscard]] std::string str() const;
};

class DOPPEL_API Diagnostics {
 public:
  void add(Diagnostic diagnostic);
  void error(std::string rule, SourceLocation where, std::string message, std::string fix = "");
  void warning(std::string rule, SourceLocation where, std::string message, std::string fix = "");
  void note(std::string rule, SourceLocation where, std::string message, std::string fix = "");

  [[nodiscard]] const std::vector<Diagnostic>& all() const { return all_; }
  [[nodiscard]] std::size_t count(Severity severity) const;
  [[nodiscard]] bool has_errors() const { return count(Severity::error) > 0; }

  // Throws InputError with every error collected so far, if there is one.
  void throw_if_errors() const;

 private:
  std::vector<Diagnostic> all_;
};

// For the terminal: equal messages are one, with the number of their places. Of more than `most` + 1 notes and
// warnings of one rule, the first `most` are followed by one that counts the others.
inline constexpr std::size_t kAllOfRule = 1'000'000, kFewOfRule = 3;
DOPPEL_API std::vector<Diagnostic> condensed(const Diagnostics& diagnostics, std::size_t most = kAllOfRule);

// Input that cannot be used. what() is the complete text for the terminal, one diagnostic after another.
class DOPPEL_API InputError : public std::runtime_error {
 public:
  explicit InputError(Diagnostic diagnostic);
  explicit InputError(std::vector<Diagnostic> diagnostics);
  InputError(std::string rule, SourceLocation where, std::string message, std::string fix = "");

  [[nodiscard]] const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }

 private:
  std::vector<Diagnostic> diagnostics_;
};

}  // namespace doppel
