// Detects measurements of a model that their own correction has changed since.
#include <algorithm>
#include <cmath>

#include "doppel/review/calibration/calibration.h"

namespace doppel {
namespace {

constexpr double kSameErrorShare = 0.1;  // of the older zero: a second error this close to it is a repetition
constexpr double kSmallZero = 0.017453292519943295;  // rad or m: smaller differences are not significant

bool share_a_measurement(const Operation& a, const Operation& b) {
  return std::ranges::any_of(a.evidence, [&](const std::string& one) {
    return std::ranges::find(b.evidence, one) != b.evidence.end();
  });
}

// The joint of an operation, by its last name.
std::string last_name(const std::vector<Operation>& operations, std::size_t i) {
  std::string name = target_name(operations[i].action);
  for (std::size_t j = i + 1; j < operations.size(); ++j) {
    const auto* renaming = std::get_if<Rename>(&operations[j].action);
    if (renaming != nullptr && renaming->kind == "joint" && renaming->from == name) name = renaming->to;
  }
  return name;
}

// From any source: a wrong correction is removed, not reversed by a second one.
bool is_repetition_of(const Operation& old, const Operation& fresh) {
  if (std::holds_alternative<FlipAxis>(old.action)) return std::holds_alternative<FlipAxis>(fresh.action);
  const auto* before = std::get_if<BakeZero>(&old.action);
  const auto* now = std::get_if<BakeZero>(&fresh.action);
  if (before == nullptr || now == nullptr || std::abs(before->offset) < kSmallZero) return false;
  return std::abs(now->offset - before->offset) < kSameErrorShare * std::abs(before->offset);
}

}  // namespace

std::vector<std::size_t> zeros_of(const std::vector<Operation>& corrections, const std::string& joint) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < corrections.size(); ++i) {
    const OperationAction& action = corrections[i].action;
    const bool kind = std::holds_alternative<FlipAxis>(action) || std::holds_alternative<BakeZero>(action);
    if (kind && last_name(corrections, i) == joint) out.push_back(i);
  }
  return out;
}

std::optional<std::size_t> correction_made_of(const std::vector<Operation>& corrections,
                                              const std::string& joint, const std::vector<Operation>& fresh) {
  for (const std::size_t i : zeros_of(corrections, joint)) {
    const bool again = std::ranges::any_of(fresh, [&](const Operation& operation) {
      return share_a_measurement(corrections[i], operation) || is_repetition_of(corrections[i], operation);
    });
    if (again) return i;
  }
  return {};
}

}  // namespace doppel
