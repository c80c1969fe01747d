#include "doppel/session/live/detail/calibration_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/output_file.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/review/calibration/corrections.h"
#include "doppel/scenario/resolve/open_target.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

std::optional<std::string> content_of(const fs::path& file) {
  constexpr std::size_t kMaxBytes = std::size_t{16} << 20;
  FileContent content = read_content(file, kMaxBytes);
  return content.was_read() ? std::optional(std::move(content.bytes)) : std::nullopt;
}

void check_joint(const RobotDescription& present, const Joint& measured) {
  const Joint* const joint = present.find_joint(measured.name);
  if (joint != nullptr && is_same_joint(*joint, measured)) return;
  throw InputError(
      "calibrate.changed", measured.source,
      fmt::format("'{}' is another joint in the file than in the running model, which was measured",
                  measured.name),
      "restart, or save the file again, and measure the joint again");
}

}  // namespace

bool is_same_joint(const Joint& a, const Joint& b) {
  const auto ends = [](const Joint& joint) {
    return joint.limits ? std::pair{joint.limits->lower, joint.limits->upper} : std::pair{0.0, 0.0};
  };
  return a.name == b.name && a.type == b.type && a.origin.xyz == b.origin.xyz &&
         a.origin.rpy == b.origin.rpy && a.axis == b.axis && ends(a) == ends(b);
}

WrittenCorrections write_corrections(const WorldRobot& robot, const fs::path& bundled_robots,
                                     std::vector<MeasuredJoint> joints) {
  OpenedTarget target = open_target(robot.target, robot.arguments, bundled_robots);
  Diagnostics diagnostics;
  ExpandedDescription expanded =
      expand_description(target.target.description, target.arguments, target.resolver, diagnostics);
  const std::vector<AppliedOverlay> overlays = apply_overlays(expanded, target.resolver, diagnostics);
  const RobotDescription present = read_description(expanded, target.resolver, diagnostics);
  diagnostics.throw_if_errors();
  WrittenCorrections out;
  out.name_space = robot.name_space;
  std::vector<Operation> all;
  for (MeasuredJoint& one : joints) {
    check_joint(present, one.joint);
    refuse_repetition(one.joint.name, one.operations, overlays, robot.target);
    apply_in_order(one.operations, expanded, target.resolver);
    std::ranges::move(one.operations, std::back_inserter(all));
    out.joints.push_back(one.joint.name);
  }
  out.before = content_of(overlay_path(target.target.description));
  out.file = add_to_overlay(target.target.description, all);
  out.after = content_of(out.file).value_or("");
  return out;
}

void take_back(const WrittenCorrections& written) {
  if (content_of(written.file) != written.after)
    throw InputError("calibrate.undo", {}, fmt::format("{} has changed since", shown_path(written.file)),
                     "remove the corrections with doppel overlay remove");
  if (written.before) return write_whole(written.file, *written.before);
  std::error_code failed;
  if (!fs::remove(written.file, failed))
    throw InputError("calibrate.undo", {},
                     fmt::format("{} cannot be removed: {}", shown_path(written.file), failed.message()));
}

}  // namespace doppel
