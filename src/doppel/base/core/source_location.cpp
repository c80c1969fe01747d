#include "doppel/base/core/source_location.h"

#include <fmt/format.h>

#include <vector>

namespace doppel {

std::string SourceLocation::place() const {
  if (!file) return "<unknown>";
  if (line <= 0) return *file;
  if (column <= 0) return fmt::format("{}:{}", *file, line);
  return fmt::format("{}:{}:{}", *file, line, column);
}

std::string SourceLocation::str() const {
  std::vector<const SourceLocation*> places{this};
  std::vector<const std::string*> steps;
  for (const Within* w = within.get(); w != nullptr; w = w->call.within.get()) {
    steps.push_back(&w->what);
    places.push_back(&w->call);
  }
  std::string out = places.back()->place();
  for (std::size_t i = steps.size(); i-- > 0;) {
    out += fmt::format(": {} ({})", *steps[i], places[i]->place());
  }
  return out;
}

SourceLocation make_location(std::string file, int line, int column) {
  return {std::make_shared<const std::string>(std::move(file)), line, column, nullptr};
}

}  // namespace doppel
