// The file of a motion plan, and the hash of the arm that it is for.
#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "doppel/base/core/read_file.h"
#include "doppel/base/core/sha256.h"
#include "doppel/review/identification/motion_plan.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxPlanBytes = std::size_t{1} << 24U;
constexpr int kVersion = 1;
constexpr std::size_t kHashDigits = 16;

std::string quoted(const std::string& text) {
  YAML::Emitter out;
  out << YAML::DoubleQuoted << text;
  return out.c_str();
}

PlannedJoint read_joint(const YAML::Node& node) {
  PlannedJoint out;
  out.joint = node["joint"].as<std::string>();
  out.condition = node["condition"].as<double>();
  out.speed = node["speed"].as<double>();
  out.effort = node["effort"].as<double>();
  for (const YAML::Node& point : node["path"])
    out.path.push_back({point[0].as<double>(), point[1].as<double>()});
  if (const YAML::Node release = node["release"])
    out.release = {release["lift"].as<double>(), release["lower"].as<double>(), release["upper"].as<double>(),
                   release["speed"].as<double>(), release["duration"].as<double>()};
  return out;
}

}  // namespace

std::string arm_hash(const Model& model) {
  std::string text;
  for (const ModelJoint& joint : model.joints) {
    text += fmt::format("{}\n{} {}", joint.name, static_cast<int>(joint.type), joint.parent_link);
    for (const double x : joint.X_PJ.matrix().reshaped()) text += fmt::format(" {:.6f}", x + 0.0);
    for (const double x : joint.axis) text += fmt::format(" {:.6f}", x + 0.0);
    text += fmt::format(" {:.6g} {:.6g} {:.6g} {}\n", joint.lower, joint.upper, joint.velocity,
                        joint.mimic_leader);
  }
  for (const ModelLink& link : model.links)
    text += fmt::format("{} {:.6g}\n", link.name, link.inertia ? link.inertia->mass : 0.0);
  return sha256_hex(text).substr(0, kHashDigits);
}

std::string to_yaml(const MotionPlan& plan) {
  std::string payload;
  std::string out = fmt::format(
      "# A motion for doppel identify record --plan; times in s, positions in rad or m.\nversion: {}\n"
      "robot: {}\narm: {}\n",
      kVersion, quoted(plan.robot), quoted(plan.arm));
  if (plan.payload)
    payload = fmt::format("payload: {}\npayload_link: {}\n", payload_text(*plan.payload),
                          quoted(plan.payload->link));
  out += payload + "pose:\n";
  for (const auto& [joint, position] : plan.pose) out += fmt::format("  {}: {}\n", quoted(joint), position);
  out += "joints:\n";
  for (const PlannedJoint& one : plan.joints) {
    out += fmt::format("- joint: {}\n  condition: {:.4g}\n  speed: {:.3f}\n  effort: {:.3f}\n",
                       quoted(one.joint), one.condition, one.speed, one.effort);
    if (one.release)
      out += fmt::format(
          "  release: {{lift: {:.9g}, lower: {:.9g}, upper: {:.9g}, speed: {:.6g}, duration: {:.4g}}}\n",
          one.release->lift, one.release->lower, one.release->upper, one.release->speed,
          one.release->duration);
    out += "  path:\n";
    for (const Waypoint& point : one.path)
      out += fmt::format("  - [{:.9g}, {:.9g}]\n", point.time, point.position);
  }
  if (!plan.notes.empty()) out += "notes:\n";
  for (const std::string& note : plan.notes) out += fmt::format("- {}\n", quoted(note));
  return out;
}

MotionPlan read_motion_plan(const std::filesystem::path& file) {
  const std::string text = read_file(file.string(), kMaxPlanBytes);
  try {
    const YAML::Node root = YAML::Load(text);
    if (!root.IsMap() || !root["version"] || root["version"].as<int>() != kVersion)
      throw InputError("identify.plan", make_location(file.string()),
                       fmt::format("this is no plan of version {}", kVersion),
                       "doppel identify plan writes one");
    MotionPlan out;
    out.robot = root["robot"].as<std::string>();
    out.arm = root["arm"].as<std::string>();
    if (const YAML::Node payload = root["payload"]) {
      const YAML::Node link = root["payload_link"];
      out.payload = read_payload(payload.as<std::string>(), link ? link.as<std::string>() : "");
    }
    for (const auto& entry : root["pose"])
      out.pose[entry.first.as<std::string>()] = entry.second.as<double>();
    for (const YAML::Node& node : root["joints"]) out.joints.push_back(read_joint(node));
    for (const YAML::Node& node : root["notes"]) out.notes.push_back(node.as<std::string>());
    return out;
  } catch (const YAML::Exception& problem) {
    const auto path = std::make_shared<const std::string>(file.string());
    throw InputError("identify.plan", {path, problem.mark.line + 1, problem.mark.column + 1, nullptr},
                     fmt::format("this is no plan: {}", problem.msg), "doppel identify plan writes one");
  }
}

}  // namespace doppel
