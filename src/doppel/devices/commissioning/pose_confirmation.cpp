#include "doppel/devices/commissioning/pose_confirmation.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/devices/commissioning/bus_scan.h"
#include "doppel/devices/drivers/pose_record.h"

namespace doppel {
namespace {

constexpr double kSlack = 1e-6;  // rad

void check_position(const ServoSetup& setup, const std::string& joint, double position, Diagnostics& errors) {
  std::vector<std::string> names;
  for (const JointServo& one : setup.joints) names.push_back(one.joint);
  const auto servo = std::ranges::find(setup.joints, joint, &JointServo::joint);
  if (servo == setup.joints.end())
    return errors.error("hardware.unknown_joint", {},
                        fmt::format("no servo drives '{}'{}", joint, did_you_mean(joint, names)));
  if (position < servo->lower - kSlack || position > servo->upper + kSlack)
    errors.error("hardware.outside", servo->source,
                 fmt::format("{:.4g} rad are outside of the limits {:.4g} to {:.4g} of '{}'", position,
                             servo->lower, servo->upper, joint));
}

}  // namespace

void confirm_pose(ByteLink& link, const ServoSetup& setup,
                  const std::vector<std::pair<std::string, double>>& positions) {
  if (setup.protocol != ServoProtocol::servo_line)
    throw InputError("hardware.has_sensors", {},
                     fmt::format("the servos of '{}' measure their positions; nothing is to be confirmed",
                                 setup.component));
  Diagnostics errors;
  for (const auto& [joint, position] : positions) check_position(setup, joint, position, errors);
  for (const JointServo& one : setup.joints) {
    const auto named = std::ranges::find(positions, one.joint, &std::pair<std::string, double>::first);
    if (one.enabled && named == positions.end())
      errors.error("hardware.pose", one.source, fmt::format("the position of '{}' is missing", one.joint),
                   "name every joint: \"joint 1=90\" \"joint 2=45\"");
  }
  errors.throw_if_errors();
  const std::vector<FoundDevice> found =
      scan_link(link, {.protocols = {ServoProtocol::servo_line}, .rates = {setup.rate}});
  if (found.empty())
    throw InputError("hardware.no_answer", {},
                     fmt::format("no board answers on {} at {} bit/s", link.name(), setup.rate),
                     "doppel hardware scan");
  write_pose_record(pose_record_file(setup.component, setup.port),
                    {.boot = found.front().boot, .positions = positions});
}

}  // namespace doppel
