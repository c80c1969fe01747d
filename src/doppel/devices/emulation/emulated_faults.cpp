#include "doppel/devices/emulation/emulated_faults.h"

#include <algorithm>
#include <array>
#include <utility>

namespace doppel {
namespace {

constexpr std::array<std::pair<FaultKind, std::string_view>, 12> kNames{
    {{FaultKind::drop, "drop"},
     {FaultKind::corrupt, "corrupt"},
     {FaultKind::late, "late"},
     {FaultKind::stranger, "stranger"},
     {FaultKind::echo, "echo"},
     {FaultKind::unplug, "unplug"},
     {FaultKind::brown_out, "brown_out"},
     {FaultKind::stuck, "stuck"},
     {FaultKind::slip, "slip"},
     {FaultKind::wrong_direction, "wrong_direction"},
     {FaultKind::hot, "hot"},
     {FaultKind::overload, "overload"}}};

}  // namespace

std::string_view to_string(FaultKind kind) {
  return std::ranges::find(kNames, kind, &std::pair<FaultKind, std::string_view>::first)->second;
}

std::vector<std::string> fault_kinds() {
  std::vector<std::string> out;
  for (const auto& [kind, name] : kNames) out.emplace_back(name);
  return out;
}

std::optional<FaultKind> fault_kind(std::string_view name) {
  const auto found = std::ranges::find(kNames, name, &std::pair<FaultKind, std::string_view>::second);
  if (found == kNames.end()) return {};
  return found->first;
}

}  // namespace doppel
