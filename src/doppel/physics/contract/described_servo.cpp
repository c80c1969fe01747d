#include "doppel/physics/contract/described_servo.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/base/xml/xml.h"

namespace doppel {
namespace {

constexpr const char* kElement = "doppel:servo";

struct Field {
  const char* name;
  std::optional<double> DescribedServo::*value;
  bool positive;  // 0 is no value
};
constexpr Field kFields[] = {
    {"stiffness", &DescribedServo::stiffness, true},
    {"damping", &DescribedServo::damping, false},
    {"armature", &DescribedServo::armature, false},
    {"delay", &DescribedServo::delay, false},
    {"backlash", &DescribedServo::backlash, false},
    {"resolution", &DescribedServo::resolution, false},
    {"rms", &DescribedServo::rms, false},
};

std::vector<std::string> field_names() {
  std::vector<std::string> out;
  for (const Field& field : kFields) out.emplace_back(field.name);
  return out;
}

const Field* field_named(const std::string& name) {
  for (const Field& field : kFields) {
    if (name == field.name) return &field;
  }
  return nullptr;
}

void read_attribute(const XmlAttribute& attribute, DescribedServo& out, Diagnostics& diagnostics) {
  const Field* field = field_named(attribute.name);
  if (field == nullptr) {
    diagnostics.warning("servo.value", attribute.where,
                        fmt::format("<{}> has no '{}'{}; it has no effect", kElement, attribute.name,
                                    did_you_mean(attribute.name, field_names())),
                        "doppel man identification.md lists the values");
    return;
  }
  double value = 0;
  const char* const end = attribute.value.data() + attribute.value.size();
  const auto [rest, problem] = std::from_chars(attribute.value.data(), end, value);
  if (problem == std::errc() && rest == end && std::isfinite(value) && value >= 0 &&
      (value > 0 || !field->positive)) {
    out.*field->value = value;
    return;
  }
  diagnostics.warning(
      "servo.value", attribute.where,
      fmt::format("{} of <{}> is '{}', which is not a {} number; it has no effect", attribute.name, kElement,
                  attribute.value, field->positive ? "positive" : "non-negative"),
      "write the value in rad, m, s, N, kg and their products, without a unit");
}

}  // namespace

std::vector<DescribedServo> described_servos(const RobotDescription& robot, Diagnostics& diagnostics) {
  std::vector<DescribedServo> out;
  for (const GazeboExtension& extension : robot.gazebo) {
    if (extension.node == nullptr) continue;
    for (const XmlNode& child : extension.node->children) {
      if (!child.is(kElement)) continue;
      DescribedServo servo;
      servo.joint = extension.reference;
      servo.source = child.where;
      for (const XmlAttribute& attribute : child.attributes) read_attribute(attribute, servo, diagnostics);
      out.push_back(std::move(servo));
    }
  }
  return out;
}

std::vector<ServoParameters> choose_servos(const RobotDescription& robot, const Model& model,
                                           const ServoOptions& options, const Eigen::Vector3d& gravity) {
  std::vector<ServoParameters> out = choose_servos(model, options, gravity);
  Diagnostics reported;  // by described_servos() where a robot is compiled
  for (const DescribedServo& described : described_servos(robot, reported)) {
    const int index = model.find_joint(described.joint);
    if (index < 0) continue;
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(index)];
    if (!joint.scalar() || joint.mimics()) continue;
    ServoParameters& servo = out[static_cast<std::size_t>(index)];
    if (described.stiffness) {
      if (servo.stiffness > 0) servo.damping *= std::sqrt(*described.stiffness / servo.stiffness);
      servo.stiffness = *described.stiffness;
    }
    if (described.damping) servo.damping = *described.damping;
    if (!described.armature) continue;
    servo.armature = *described.armature;
    servo.rotor_inertia = std::max(0.0, servo.rotor_inertia - servo.armature);
  }
  return out;
}

}  // namespace doppel
