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

const EmulatedFault* FaultPlan::find(FaultKind kind, int servo, Time now) const {
  const auto found = std::ranges::find_if(faults_, [&](const EmulatedFault& one) {
    return one.kind == kind && now >= one.begin && now < one.end && (!one.servo || *one.servo == servo);
  });
  return found == faults_.end() ? nullptr : &*found;
}

bool FaultPlan::draw(FaultKind kind, int servo, Time now) {
  const EmulatedFault* const fault = find(kind, servo, now);
  return fault != nullptr && std::uniform_real_distribution<double>()(random_) < fault->share;
}

}  // namespace doppel
