#include "doppel/description/scaffold/package_name.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/text.h"

namespace doppel::scaffold {
namespace {

constexpr std::string_view kSuffix = "_description";

bool is_letter(char c) {
  return c >= 'a' && c <= 'z';
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

bool is_valid(std::string_view name) {
  return name.size() >= 2 && name.size() <= 100 && is_letter(name.front()) && name.back() != '_' &&
         name.find("__") == std::string_view::npos &&
         std::ranges::all_of(name, [](char c) { return is_letter(c) || is_digit(c) || c == '_'; });
}

// The same name in a form that ROS accepts; empty where no character is valid.
std::string repaired(std::string_view name) {
  std::string out;
  for (const char c : lowered(name)) {
    if (is_letter(c) || (is_digit(c) && !out.empty())) {
      out += c;
    } else if (!out.empty() && out.back() != '_') {
      out += '_';
    }
  }
  out.resize(std::min<std::size_t>(out.size(), 80));
  while (out.ends_with('_')) out.pop_back();
  return is_valid(out) ? out : "";
}

}  // namespace

PackageName package_name(std::string_view name) {
  const std::string_view robot =
      name.ends_with(kSuffix) ? name.substr(0, name.size() - kSuffix.size()) : name;
  if (is_valid(robot)) return {std::string(robot), std::string(robot) + std::string(kSuffix)};
  const std::string near = repaired(robot);
  throw InputError(
      "new.name", {},
      fmt::format("'{}' is not a valid package name: ROS 2 takes two or more lower-case letters, digits and "
                  "single underscores, a letter first",
                  name),
      near.empty() ? "choose a name like my_arm" : fmt::format("doppel new {}", near));
}

}  // namespace doppel::scaffold
