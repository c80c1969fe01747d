#include "doppel/base/packages/find_expression.h"

#include <string_view>

namespace doppel {

std::string with_found_package(std::string text, const PackageResolver& resolver) {
  constexpr std::string_view kOpen = "$(find ";
  const std::size_t begin = text.find(kOpen);
  const std::size_t end = text.find(')', begin);
  if (begin == std::string::npos || end == std::string::npos) return text;
  const std::string name = text.substr(begin + kOpen.size(), end - begin - kOpen.size());
  const auto package = resolver.find_package(name).path;
  return package.empty() ? text : text.replace(begin, end - begin + 1, package.string());
}

}  // namespace doppel
