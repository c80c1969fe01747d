#pragma once
// Names in a robot's namespace.

#include <string>
#include <string_view>

namespace doppel {

// "/left/doppel" for ("left", "doppel"), "/doppel" for a robot without a namespace.
inline std::string in_namespace(const std::string& name_space, std::string_view name) {
  return name_space.empty() ? "/" + std::string(name) : "/" + name_space + "/" + std::string(name);
}

}  // namespace doppel
