#include "doppel/twin/viewer/detail/drawable.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace doppel {
namespace {

// The parser's errors that do not prevent a picture, and what is drawn instead.
constexpr std::array<std::pair<std::string_view, std::string_view>, 1> kForgiven{{
    {"urdf.joint_type", "it is drawn as fixed"},
}};

void forgive(const Diagnostics& found, Diagnostics& out) {
  std::vector<Diagnostic> refused;
  for (Diagnostic diagnostic : found.all()) {
    const auto named = [&](const auto& forgiven) { return forgiven.first == diagnostic.rule; };
    const auto* forgiven = std::find_if(kForgiven.begin(), kForgiven.end(), named);
    if (diagnostic.severity == Severity::error && forgiven == kForgiven.end()) {
      refused.push_back(std::move(diagnostic));
      continue;
    }
    if (diagnostic.severity == Severity::error) {
      diagnostic.severity = Severity::warning;
      diagnostic.message += fmt::format("; {}", forgiven->second);
    }
    out.add(std::move(diagnostic));
  }
  if (!refused.empty()) throw InputError(std::move(refused));
}

}  // namespace

void make_drawable(const Diagnostics& found, Diagnostics& out) {
  forgive(found, out);
}

}  // namespace doppel
