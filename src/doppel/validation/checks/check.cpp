#include "doppel/validation/checks/check.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <stdexcept>

namespace doppel {

std::string_view to_string(Verdict verdict) {
  static constexpr std::array<std::string_view, 7> kNames = {"not applicable", "passed",  "waived", "warning",
                                                             "not judged",     "not run", "failed"};
  return kNames[static_cast<std::size_t>(verdict)];
}

bool is_failure(Verdict verdict, bool strict) {
  if (verdict == Verdict::failed || verdict == Verdict::not_run) return true;
  return strict && (verdict == Verdict::warned || verdict == Verdict::not_judged);
}

CheckItem& CheckResult::add(CheckItem item) {
  verdict = std::max(verdict, item.verdict);
  return items.emplace_back(std::move(item));
}

void CheckResult::fail(std::string subject, std::string message, std::string fix, SourceLocation where) {
  add({std::move(subject), Verdict::failed, std::move(message), std::move(fix), std::move(where)});
}

namespace {

std::vector<CheckInfo> gates_and_tests() {
  return {
      {"G01", "Origin of the description", CheckKind::gate,
       "every file that is read has a hash, and every correction of an overlay applies",
       "nothing changed, no target missing"},
      {"G02", "Parses without error", CheckKind::gate, "the audit's errors about the file and its tree",
       "0 errors"},
      {"G03", "Tree as designed", CheckKind::gate, "the tree equals the committed validation/tree.txt",
       "no difference"},
      {"G04", "Inertias", CheckKind::gate, "the audit's rules about masses and inertias", "0 errors"},
      {"G05", "Collision shapes", CheckKind::gate,
       "triangles of each collision mesh, and their ratio to its visual",
       "at most 2000 triangles, a tenth of the visual's"},
      {"G06", "Joint limits", CheckKind::gate, "the audit's rules about joints and their datasheets",
       "0 errors"},
      {"G07", "Loads, draws, moves", CheckKind::gate,
       "every mesh is found, and every joint has finite poses at its lower, middle and upper position",
       "all"},
      {"G08", "Transforms complete", CheckKind::gate,
       "one root, a transform of every link, no gap over two periods in 2 s, static ones latched", "all"},
      {"G09", "Hardware and controllers active", CheckKind::gate,
       "states after the start; a joint that can be commanded is in a controller", "all"},
      {"G10", "One command brings it up", CheckKind::gate, "the time until the first motion", "2 s"},
      {"G11", "Physics without errors", CheckKind::gate,
       "10 s of holding the start pose at steps of 0.5, 1 and 2 ms", "drift 1 mrad, 0.1 mm; real time"},
      {"G12", "Reachability", CheckKind::gate, "test T1", "that of T1"},
      {"G13", "Limits enforced", CheckKind::gate, "test T2", "that of T2"},
      {"G14", "Self-collision sweep", CheckKind::gate, "test T3", "that of T3"},
      {"G15", "Drop test", CheckKind::gate, "test T6", "that of T6"},
      {"T1", "Reachability", CheckKind::test,
       "inverse kinematics of poses that are reachable by construction, and a grid over the workspace",
       "5 % missed"},
      {"T2", "Joint limit enforcement", CheckKind::test,
       "commands beyond position, speed and effort limits, NaN and jumps, on every way to a joint",
       "position 2 mrad (0.2 mm), speed 102 %, effort 100 % of the limit"},
      {"T3", "Self-collision sweep", CheckKind::test,
       "configurations over the whole joint space, and pairs that an SRDF disables", "the start is free"},
      {"T4", "Step response", CheckKind::test, "a step of 0.5 rad through the real controller",
       "overshoot 10 %, settling 0.5 s, error 0.01 rad"},
      {"T5", "Sensor coverage", CheckKind::test, "lines of sight of each sensor over the workspace",
       "the suite's min_seen"},
      {"T6", "Drop test", CheckKind::test, "the robot falls 1 cm without drives, at steps of 0.5, 1 and 2 ms",
       "settled by 2 s, penetration 1 mm, no energy gained"},
  };
}

std::vector<CheckInfo> extras() {
  return {
      {"X1", "Kinematics", CheckKind::extra,
       "round trips through inverse kinematics, the Jacobian against differences, links against the engine",
       "1e-9 m; after a round trip 1e-4 m"},
      {"X2", "Frequency response", CheckKind::extra,
       "a sine sweep of each joint through its controller, beside the servo model", "none"},
      {"X3", "Pose accuracy", CheckKind::extra,
       "30 cycles through the test poses of ISO 9283, against the commanded ones", "none"},
      {"X4", "Approach of poses", CheckKind::extra,
       "time, stabilisation, overshoot, distances and drift in the same cycles, and approaches from three "
       "directions",
       "none"},
      {"X5", "Paths", CheckKind::extra,
       "10 passages of the line, the circle and the corner of ISO 9283 at 10, 50 and 100 % of the speed",
       "none"},
      {"X6", "Payload", CheckKind::extra,
       "the mass that the drives hold in the worst pose, over the reach of each arm", "none"},
      {"X7", "Sag", CheckKind::extra, "the displacement of the tool by gravity against the drives", "none"},
      {"X8", "Power", CheckKind::extra, "the mechanical power of the drives in a cycle of X3",
       "warning: the current of the suite's supply"},
      {"X9", "Stopping", CheckKind::extra,
       "stops of categories 0, 1 and 2 at 33, 66 and 100 % of speed and reach", "none"},
      {"X10", "Contact", CheckKind::extra,
       "effective mass and speed of the tool, and the contact speed by the suite's regions of a body",
       "none"},
      {"X11", "Singularities", CheckKind::extra,
       "singular values of the Jacobian in named poses and on straight lines between them", "none"},
  };
}

}  // namespace

const std::vector<CheckInfo>& check_table() {
  static const std::vector<CheckInfo> kTable = [] {
    std::vector<CheckInfo> out = gates_and_tests();
    std::ranges::copy(extras(), std::back_inserter(out));
    return out;
  }();
  return kTable;
}

const CheckInfo* find_check(std::string_view id) {
  const auto found = std::ranges::find(check_table(), id, &CheckInfo::id);
  return found == check_table().end() ? nullptr : &*found;
}

CheckResult begin_result(std::string_view id) {
  const CheckInfo* const info = find_check(id);
  if (info == nullptr) throw std::logic_error("there is no check " + std::string(id));
  CheckResult out;
  out.id = info->id;
  out.title = info->title;
  return out;
}

CheckResult not_applicable(std::string_view id, std::string reason) {
  CheckResult out = begin_result(id);
  out.verdict = Verdict::not_applicable;
  out.summary = std::move(reason);
  return out;
}

}  // namespace doppel
