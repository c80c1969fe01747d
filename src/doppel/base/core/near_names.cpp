#include "doppel/base/core/near_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "doppel/base/core/names.h"

namespace doppel {

std::string names_near(std::string_view name, std::span<const std::string> candidates) {
  constexpr std::size_t kMaxNames = 3;
  std::string near = did_you_mean(name, candidates);
  if (!near.empty() || candidates.empty()) return near;
  std::vector<std::pair<std::size_t, std::string>> by_distance;
  for (const std::string& candidate : candidates)
    by_distance.emplace_back(edit_distance(name, candidate), fmt::format("'{}'", candidate));
  std::ranges::sort(by_distance);
  std::vector<std::string> nearest;
  for (const auto& [distance, quoted] : by_distance) {
    if (nearest.size() < kMaxNames) nearest.push_back(quoted);
  }
  return fmt::format("; the nearest are {}", fmt::join(nearest, ", "));
}

}  // namespace doppel
