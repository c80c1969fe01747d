#include "doppel/session/live/detail/calibration_entries.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "doppel/base/core/names.h"
#include "doppel/session/live/detail/calibration_file.h"
#include "doppel/session/live/detail/service_refusal.h"

namespace doppel {
namespace {

constexpr double kSamePose = 1e-6;  // rad or m
constexpr std::size_t kMaxMeasurements = 20;

void fit(CalibrationEntry& entry) {
  entry.result.reset();
  entry.problem.clear();
  if (entry.measurements.size() < 2) return;
  try {
    entry.result = correct_joint(entry.joint, entry.measurements, LimitChoice::keep);
  } catch (const InputError& error) {
    entry.problem = refusal_text(error);
  }
}

bool is_one_of(const CalibrationEntry& entry, const std::string& name_space, const std::string& joint) {
  return entry.robot.name_space == name_space && (joint.empty() || entry.joint.name == joint);
}

std::vector<Measurement> joined(std::vector<Measurement> measurements, Measurement fresh) {
  std::erase_if(measurements,
                [&](const Measurement& one) { return std::abs(one.model - fresh.model) < kSamePose; });
  measurements.push_back(fresh);
  return measurements;
}

doppel_msgs::msg::JointCalibration to_msg(const CalibrationEntry& entry) {
  doppel_msgs::msg::JointCalibration out;
  out.robot = entry.robot.name_space;
  out.joint = entry.joint.name;
  if (const auto poses = suggested_poses(entry.joint)) out.poses.assign(poses->begin(), poses->end());
  for (const Measurement& one : entry.measurements) out.measurements.push_back({one.model, one.machine});
  out.problem = entry.problem;
  out.written = entry.written;
  if (!entry.result) return out;
  const JointFit& fit = entry.result->fit;
  out.fitted = true;
  out.direction = fit.direction;
  out.zero = fit.offset;
  out.scale = fit.scale;
  out.residual = fit.worst_residual();
  for (const Operation& one : entry.result->operations) out.corrections.push_back(describe(one.action));
  for (const std::string& doubt : doubts_about(entry.joint, fit, entry.measurements))
    out.warnings.push_back(doubt);
  return out;
}

}  // namespace

void CalibrationEntries::update(std::vector<CalibratedRobot> robots) {
  std::vector<CalibrationEntry> former = std::exchange(entries_, {});
  for (CalibratedRobot& robot : robots) {
    for (Joint& joint : robot.joints) {
      CalibrationEntry entry{.robot = robot.source, .joint = std::move(joint)};
      for (CalibrationEntry& old : former) {
        if (!is_one_of(old, entry.robot.name_space, entry.joint.name)) continue;
        entry.written = old.written;
        if (is_same_joint(old.joint, entry.joint)) entry.measurements = std::move(old.measurements);
      }
      fit(entry);
      entries_.push_back(std::move(entry));
    }
  }
}

const CalibrationEntry& CalibrationEntries::find(const std::string& name_space,
                                                 const std::string& joint) const {
  std::vector<std::string> names;
  for (const CalibrationEntry& entry : entries_) {
    if (entry.robot.name_space != name_space) continue;
    if (entry.joint.name == joint) return entry;
    names.push_back(entry.joint.name);
  }
  throw InputError("calibrate.joint", {},
                   fmt::format("no device drives a joint '{}'{}", joint, did_you_mean(joint, names)));
}

std::vector<const CalibrationEntry*> CalibrationEntries::with_results(
    const std::string& name_space, const std::vector<std::string>& joints) const {
  std::vector<const CalibrationEntry*> out;
  for (const std::string& name : joints) out.push_back(&find(name_space, name));
  for (const CalibrationEntry& entry : entries_) {
    if (joints.empty() && entry.robot.name_space == name_space && entry.result) out.push_back(&entry);
  }
  if (out.empty())
    throw InputError("calibrate.nothing", {}, "no joint has a result", "measure one at two poses");
  for (const CalibrationEntry* entry : out) {
    if (!entry->result)
      throw InputError("calibrate.nothing", {},
                       fmt::format("'{}' has no result{}", entry->joint.name,
                                   entry->problem.empty() ? "" : ": " + entry->problem),
                       "measure it at two poses");
  }
  return out;
}

std::vector<Measurement> CalibrationEntries::with(const CalibrationEntry& entry, Measurement fresh) {
  if (!std::isfinite(fresh.model))
    throw InputError("calibrate.pose", {}, "the pose of the model is no number");
  std::vector<Measurement> out = joined(entry.measurements, fresh);
  if (out.size() > kMaxMeasurements)
    throw InputError("calibrate.pose", {},
                     fmt::format("'{}' has {} measurements already", entry.joint.name, kMaxMeasurements),
                     "forget them first");
  if (out.size() > 1) check_spread(entry.joint, out);
  return out;
}

void CalibrationEntries::keep(const std::string& name_space, const std::string& joint, Measurement fresh) {
  for (CalibrationEntry& entry : entries_) {
    if (!is_one_of(entry, name_space, joint)) continue;
    entry.measurements = joined(std::move(entry.measurements), fresh);
    entry.written = false;
    fit(entry);
  }
}

void CalibrationEntries::forget(const std::string& name_space, const std::string& joint) {
  if (!joint.empty()) static_cast<void>(find(name_space, joint));
  for (CalibrationEntry& entry : entries_) {
    if (!is_one_of(entry, name_space, joint)) continue;
    entry.measurements.clear();
    fit(entry);
  }
}

void CalibrationEntries::note_file(const std::string& name_space, const std::vector<std::string>& joints,
                                   bool written) {
  for (CalibrationEntry& entry : entries_) {
    if (entry.robot.name_space != name_space || std::ranges::find(joints, entry.joint.name) == joints.end())
      continue;
    entry.written = written;
    entry.measurements.clear();
    fit(entry);
  }
}

void CalibrationEntries::write(doppel_msgs::msg::Calibration& message) const {
  for (const CalibrationEntry& entry : entries_) message.joints.push_back(to_msg(entry));
}

}  // namespace doppel
