// Compares an operation's fingerprint with the tree, and applies, recognises or rejects the operation.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/description/overlay/detail/overlay.h"

namespace doppel {
namespace {

using namespace overlay_detail;

// The overlay as a whole. A value that is neither the fingerprint nor the result of an operation may be the
// end of a baked chain, which the results of later operations on the same facts show.
class Application {
 public:
  Application(const Overlay& overlay, ExpandedDescription& description, const PackageResolver& resolver)
      : operations_(overlay.operations),
        around_{description.root, description.file.empty() ? "." : description.folder(), &resolver} {}

  OperationOutcome apply(std::size_t i);

 private:
  [[nodiscard]] std::string final_name(const std::string& kind, std::string name, std::size_t after) const;
  [[nodiscard]] std::string present_name(std::size_t i) const;
  [[nodiscard]] bool removed_later(std::size_t i) const;
  [[nodiscard]] bool removed_later(const std::string& kind, const std::string& name, std::size_t i) const;
  [[nodiscard]] bool same_target(std::size_t i, std::size_t j) const;
  [[nodiscard]] std::string fact_id(std::size_t i, const std::string& key) const;
  [[nodiscard]] bool same(std::size_t i, const std::string& key, const std::string& a,
                          const std::string& b) const;
  bool stands_later(std::size_t i, const std::string& key, std::string value, const std::string& now);
  const Facts& results_of_later(std::size_t j);
  OperationOutcome missing(std::size_t i) const;
  std::optional<OperationOutcome> already_renamed(std::size_t i) const;
  OperationOutcome compare(std::size_t i, Operation operation);

  const std::vector<Operation>& operations_;
  Surroundings around_;
  std::map<std::size_t, Facts> later_results_;
};

// The final name of `name` after the operations behind `after`.
std::string Application::final_name(const std::string& kind, std::string name, std::size_t after) const {
  for (std::size_t j = after + 1; j < operations_.size(); ++j) {
    const auto* renaming = std::get_if<Rename>(&operations_[j].action);
    if (renaming != nullptr && renaming->kind == kind && renaming->from == name) name = renaming->to;
  }
  return name;
}

// Of the target in the current tree: it may have its later name already.
std::string Application::present_name(std::size_t i) const {
  const OperationAction& action = operations_[i].action;
  const std::string kind = target_kind(action), name = target_name(action);
  if (kind == "robot" || find_named(around_.root, kind, name) != nullptr) return name;
  const std::string last = final_name(kind, name, i);
  return find_named(around_.root, kind, last) != nullptr ? last : name;
}

bool Application::removed_later(std::size_t i) const {
  const std::string kind = target_kind(operations_[i].action);
  return removed_later(kind, final_name(kind, target_name(operations_[i].action), i), i);
}

// `name`: the final one.
bool Application::removed_later(const std::string& kind, const std::string& name, std::size_t i) const {
  for (std::size_t j = i + 1; j < operations_.size(); ++j) {
    const auto* gone = std::get_if<Remove>(&operations_[j].action);
    if (gone == nullptr) continue;
    if (gone->kind == kind && final_name(kind, gone->name, j) == name) return true;
    const std::string* joint = find_fact(operations_[j].was, "joint");
    if (gone->kind == "link" && kind == "joint" && joint != nullptr && final_name("joint", *joint, j) == name)
      return true;
  }
  return false;
}

bool Application::same_target(std::size_t i, std::size_t j) const {
  const OperationAction &a = operations_[i].action, &b = operations_[j].action;
  const std::string kind = target_kind(a);
  return kind == target_kind(b) && final_name(kind, target_name(a), i) == final_name(kind, target_name(b), j);
}

std::string Application::fact_id(std::size_t i, const std::string& key) const {
  const OperationAction& action = operations_[i].action;
  if (std::holds_alternative<ScaleMasses>(action))
    return fmt::format("link\n{}\nmass", final_name("link", key, i));
  const std::string kind = target_kind(action);
  return fmt::format("{}\n{}\n{}", kind, final_name(kind, target_name(action), i), key);
}

// Facts that are names are compared by their final names.
bool Application::same(std::size_t i, const std::string& key, const std::string& a,
                       const std::string& b) const {
  if (same_fact(key, a, b)) return true;
  const char* kind = key == "leader" || key == "joint"   ? "joint"
                     : key == "parent" || key == "child" ? "link"
                                                         : nullptr;
  return kind != nullptr && final_name(kind, a, i) == final_name(kind, b, i);
}

const Facts& Application::results_of_later(std::size_t j) {
  const auto known = later_results_.find(j);
  if (known != later_results_.end()) return known->second;
  Facts results;
  try {
    results = result_of(operations_[j], operations_[j].was, around_);
  } catch (const InputError&) {
    results.clear();  // reported when its own operation is applied
  }
  return later_results_.emplace(j, std::move(results)).first->second;
}

bool Application::stands_later(std::size_t i, const std::string& key, std::string value,
                               const std::string& now) {
  const std::string id = fact_id(i, key);
  for (std::size_t j = i + 1; j < operations_.size(); ++j) {
    const Operation& later = operations_[j];
    if (const auto* scaling = std::get_if<ScaleMasses>(&later.action)) {
      const bool tensor = key.size() == 3 && key.front() == 'i';
      const auto number = number_of(value);
      if ((tensor || key == "mass") && number)
        value = number_text(*number * mass_factor(*scaling, later.was));
      if (tensor && same(i, key, now, value)) return true;
    }
    if (const auto* gone = std::get_if<Remove>(&later.action); gone != nullptr && same_target(i, j)) {
      if (auto left = value_without(gone->kind, key)) value = *std::move(left);
      if (same(i, key, now, value)) return true;
    }
    for (const auto& [written, result] : results_of_later(j)) {
      if (fact_id(j, written) != id) continue;
      value = result;
      if (same(i, key, now, value)) return true;
    }
  }
  return false;
}

OperationOutcome Application::missing(std::size_t i) const {
  const OperationAction& action = operations_[i].action;
  if (std::holds_alternative<Remove>(action))
    return {OperationState::already_there, fmt::format("{} is already removed", operation_target(action))};
  if (removed_later(i))
    return {OperationState::already_there,
            fmt::format("{} is already removed, as by a later operation", operation_target(action))};
  const std::string kind = target_kind(action);
  return {OperationState::no_target,
          fmt::format("there is no {}{}", operation_target(action),
                      did_you_mean(target_name(action), names_of(around_.root, kind)))};
}

std::optional<OperationOutcome> Application::already_renamed(std::size_t i) const {
  const auto* renaming = std::get_if<Rename>(&operations_[i].action);
  if (renaming == nullptr || renaming->kind == "robot") return {};
  const bool from = find_named(around_.root, renaming->kind, renaming->from) != nullptr;
  const std::string last = final_name(renaming->kind, renaming->to, i);
  const bool to = find_named(around_.root, renaming->kind, renaming->to) != nullptr ||
                  find_named(around_.root, renaming->kind, last) != nullptr;
  if (from && to) {
    return OperationOutcome{OperationState::changed,
                            fmt::format("there is already a {} '{}', next to '{}'", renaming->kind,
                                        renaming->to, renaming->from)};
  }
  if (!from && to) return OperationOutcome{OperationState::already_there, "it already has its new name"};
  return {};
}

std::string or_nothing(const std::string* text) {
  return text != nullptr ? *text : std::string(kNone);
}

OperationOutcome Application::compare(std::size_t i, Operation operation) {
  const std::string name = present_name(i);
  set_target(operation.action, name);
  std::vector<std::string> keys;
  for (const auto& [key, value] : operation.was) keys.push_back(key);
  const auto now = facts_of(operation.action, around_.root, keys);
  if (!now) return missing(i);
  const bool structural =
      std::holds_alternative<Remove>(operation.action) || std::holds_alternative<Rename>(operation.action);
  const bool masses = std::holds_alternative<ScaleMasses>(operation.action);
  const Facts result = result_of(operation, operation.was, around_);
  Facts basis = operation.was, pending;
  std::size_t standing = 0;
  for (const auto& [key, was] : operation.was) {
    const std::string current = or_nothing(find_fact(*now, key));
    const std::string* makes = find_fact(result, key);
    const bool gone = masses && find_named(around_.root, "link", key) == nullptr &&
                      removed_later("link", final_name("link", key, i), i);
    if (gone || (makes != nullptr && same(i, key, current, *makes))) {
      ++standing;
    } else if (same(i, key, current, was)) {
      set_fact(basis, key, current);
      if (makes != nullptr) pending.emplace_back(key, *makes);
    } else if (stands_later(i, key, makes != nullptr ? *makes : was, current)) {
      standing += makes != nullptr ? 1 : 0;
    } else {
      return {OperationState::changed,
              fmt::format("{} of {} is now {}; the correction was made for {}{}", key,
                          operation_target(operation.action), current, was,
                          makes != nullptr ? fmt::format(" and would change it to {}", *makes) : "")};
    }
  }
  if (pending.empty() && (!structural || standing > 0)) {
    return {OperationState::already_there,
            standing > 0 ? "the description already contains the result" : "there is nothing to do"};
  }
  // Recomputed from the tree, which may have more digits than the fingerprint.
  if (!masses) {
    const Facts exact = result_of(operation, basis, around_);
    for (auto& [key, value] : pending) value = or_nothing(find_fact(exact, key));
  }
  carry_out(operation, operation.was, pending, around_);
  later_results_.clear();
  return {OperationState::applied, ""};
}

OperationOutcome Application::apply(std::size_t i) {
  const Operation& operation = operations_[i];
  if (operation.was.empty()) {
    return {OperationState::no_fingerprint,
            "it has no fingerprint (was), so it cannot be checked against the description"};
  }
  if (auto outcome = already_renamed(i)) return *std::move(outcome);
  return compare(i, operation);
}

void report(const Operation& operation, const OperationOutcome& outcome, Diagnostics& diagnostics) {
  const std::string what =
      fmt::format("'{}' is not applied: {}", describe(operation.action), outcome.message);
  switch (outcome.state) {
    case OperationState::applied:
    case OperationState::superseded:
      return;
    case OperationState::already_there:
      diagnostics.note("overlay.already_there", operation.where, what,
                       "it can be removed from the overlay (doppel overlay remove)");
      return;
    case OperationState::changed:
      diagnostics.warning("overlay.changed", operation.where, what,
                          "check whether it is still valid, then remove it, or renew its fingerprint with "
                          "'doppel overlay stamp'");
      return;
    case OperationState::no_target:
      diagnostics.warning("overlay.no_target", operation.where, what,
                          "correct the name, or remove the operation");
      return;
    case OperationState::no_fingerprint:
      diagnostics.warning("overlay.no_fingerprint", operation.where, what,
                          "'doppel overlay stamp' takes it from the current description");
      return;
  }
}

}  // namespace

std::string_view to_string(OperationState state) {
  switch (state) {
    case OperationState::applied:
      return "applied";
    case OperationState::already_there:
      return "already present";
    case OperationState::changed:
      return "changed";
    case OperationState::no_target:
      return "no target";
    case OperationState::no_fingerprint:
      return "no fingerprint";
    case OperationState::superseded:
      return "superseded";
  }
  return "applied";
}

namespace {

// A number without a unit that would be more than one turn: degrees, most likely.
void warn_of_degrees(const Operation& operation, const XmlNode& root, Diagnostics& diagnostics) {
  if (operation.beyond_a_turn.empty()) return;
  const XmlNode* joint = find_named(root, target_kind(operation.action), target_name(operation.action));
  const bool slides = joint != nullptr && attribute_of(*joint, "type") == "prismatic";
  for (const LargeAngle& angle : operation.beyond_a_turn) {
    if (!angle.unit.empty() || (slides && angle.key != "rpy")) continue;
    const std::string number = number_text(angle.value);
    diagnostics.warning(
        "overlay.degrees", operation.where,
        fmt::format(
            "'{}': {} is {} rad, {:.3g} turns; a number without a unit is in rad; did you mean {} deg?",
            describe(operation.action), angle.key, number, std::abs(angle.value) / (2 * std::numbers::pi),
            number),
        fmt::format("write the unit: '{} deg', or '{} rad' if intended", number, number));
  }
}

// One note where nothing is left to apply: the whole file can be removed.
bool report_all_there(const Overlay& overlay, const std::vector<OperationOutcome>& outcomes,
                      Diagnostics& diagnostics) {
  const bool all = std::ranges::all_of(
      outcomes, [](const auto& outcome) { return outcome.state == OperationState::already_there; });
  if (!all || outcomes.size() < 2) return false;
  diagnostics.note("overlay.already_there", overlay.operations.front().where,
                   fmt::format("all {} corrections are already in the description", outcomes.size()),
                   "the overlay can be deleted");
  return true;
}

}  // namespace

std::vector<OperationOutcome> apply_overlay(const Overlay& overlay, ExpandedDescription& description,
                                            const PackageResolver& resolver, Diagnostics& diagnostics) {
  std::vector<OperationOutcome> outcomes;
  Application application(overlay, description, resolver);
  Diagnostics reported;
  for (std::size_t i = 0; i < overlay.operations.size(); ++i) {
    const Operation& operation = overlay.operations[i];
    try {
      outcomes.push_back(application.apply(i));
      warn_of_degrees(operation, description.root, reported);
      report(operation, outcomes.back(), reported);
    } catch (const InputError& error) {
      // A new export can cause this: operations that still match are applied, and the robot loads.
      outcomes.push_back({OperationState::changed, error.diagnostics().front().message});
      for (Diagnostic diagnostic : error.diagnostics()) {
        diagnostic.severity = Severity::warning;
        diagnostic.message =
            fmt::format("'{}' is not applied: {}", describe(operation.action), diagnostic.message);
        reported.add(std::move(diagnostic));
      }
    }
  }
  if (!report_all_there(overlay, outcomes, diagnostics)) {
    for (const Diagnostic& diagnostic : reported.all()) diagnostics.add(diagnostic);
  }
  return outcomes;
}

void take_fingerprint(Operation& operation, const ExpandedDescription& description) {
  const XmlNode& root = description.root;
  if (target_kind(operation.action) == "link" && target_name(operation.action).empty())
    set_target(operation.action, root_link(root));
  if (std::holds_alternative<AttachToWorld>(operation.action) && target_name(operation.action) == "world") {
    throw InputError("overlay.nothing_to_do", operation.where, "the robot's root is already a link 'world'",
                     "nothing needs to be attached; specify the link to attach another one");
  }
  const auto facts = facts_of(operation.action, root, fact_keys(operation.action, root));
  if (!facts) {
    throw InputError("overlay.no_target", operation.where,
                     fmt::format("there is no {}{}", operation_target(operation.action),
                                 did_you_mean(target_name(operation.action),
                                              names_of(root, target_kind(operation.action)))));
  }
  operation.was = *facts;
}

}  // namespace doppel
