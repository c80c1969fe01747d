#include "doppel/control/manager/detail/guarded_commands.h"

#include <algorithm>
#include <cmath>

#include "doppel/control/hardware/nan.h"

namespace doppel {
namespace {

constexpr double kNear = 0.1;  // rad or m: what a joint under load gives way

}  // namespace

bool GuardedCommands::Entry::commands() const {
  return !claimed_by->empty() && std::isfinite(*applied);
}

void GuardedCommands::add(ResourceTable& table, const Model& model, std::size_t command) {
  const InterfaceDescription& description = table.command_description(command);
  const int joint = model.find_joint(description.prefix);
  const auto state = table.find_state(description.prefix + "/" + kPosition);
  if (guard_ == nullptr || description.name != kPosition || joint < 0 || !state) return;
  positions_.resize(model.joints.size(), kNaN);
  entries_.push_back({static_cast<std::size_t>(joint), &table.state(*state), &table.applied(command),
                      &table.claimed_by(command), kNaN});
}

void GuardedCommands::attend(Duration period) {
  if (guard_ == nullptr || entries_.empty()) return;
  if (ticks_to_begin_ == 1) {
    for (const Entry& one : entries_) positions_[one.joint] = *one.position;
    guard_->begin(positions_, period);
    ticks_to_begin_ = 0;
  }
  guard_->attend();
}

bool GuardedCommands::is_near_permitted() const {
  return std::ranges::all_of(entries_, [](const Entry& one) {
    return !one.commands() || !std::isfinite(one.permitted) || std::abs(*one.applied - one.permitted) < kNear;
  });
}

void GuardedCommands::hold() {
  for (Entry& one : entries_) {
    if (!one.commands()) continue;
    if (!std::isfinite(one.permitted)) one.permitted = *one.position;
    *one.applied = one.permitted;
  }
}

void GuardedCommands::apply() noexcept {
  if (ticks_to_begin_ > 1) --ticks_to_begin_;
  if (guard_ == nullptr || ticks_to_begin_ > 0) return;
  bool changed = false;
  for (Entry& one : entries_) {
    const bool commands = one.commands();
    positions_[one.joint] = commands ? *one.applied : *one.position;
    changed = changed || (commands && *one.applied != one.permitted);
    if (!commands) one.permitted = kNaN;
  }
  if (!changed) {
    held_ = false;
    return;
  }
  if (held_ && !is_near_permitted()) return hold();
  held_ = !guard_->permits(positions_);
  if (held_) return hold();
  for (Entry& one : entries_) {
    if (one.commands()) one.permitted = *one.applied;
  }
}

}  // namespace doppel
