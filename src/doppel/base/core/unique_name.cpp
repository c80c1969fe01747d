#include "doppel/base/core/unique_name.h"

#include <fmt/format.h>

#include <algorithm>

namespace doppel {

std::string unique_name(const std::string& preferred, std::vector<std::string>& taken) {
  std::string name = preferred;
  for (int i = 2; std::find(taken.begin(), taken.end(), name) != taken.end(); ++i)
    name = fmt::format("{}_{}", preferred, i);
  taken.push_back(name);
  return name;
}

}  // namespace doppel
