#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/base/core/yaml_fix.h"
#include "doppel/base/math/units.h"
#include "doppel/description/overlay/detail/overlay.h"

namespace doppel {
namespace {

using namespace overlay_detail;

enum class Dimension { position, speed, effort, mass, density, plain };

struct Unit {
  std::string_view name;
  Dimension of;
  double factor;
};
constexpr std::array kUnits{
    Unit{"rad", Dimension::position, 1},      Unit{"deg", Dimension::position, kDegree},
    Unit{"m", Dimension::position, 1},        Unit{"mm", Dimension::position, 1e-3},
    Unit{"cm", Dimension::position, 1e-2},    Unit{"rad/s", Dimension::speed, 1},
    Unit{"deg/s", Dimension::speed, kDegree}, Unit{"m/s", Dimension::speed, 1},
    Unit{"mm/s", Dimension::speed, 1e-3},     Unit{"rpm", Dimension::speed, std::numbers::pi / 30},
    Unit{"N m", Dimension::effort, 1},        Unit{"Nm", Dimension::effort, 1},
    Unit{"N", Dimension::effort, 1},          Unit{"kg cm", Dimension::effort, 0.0980665},
    Unit{"kg", Dimension::mass, 1},           Unit{"g", Dimension::mass, 1e-3},
    Unit{"kg/m^3", Dimension::density, 1},    Unit{"g/cm^3", Dimension::density, 1e3},
};

std::vector<std::string> units_of(Dimension dimension) {
  std::vector<std::string> names;
  for (const Unit& unit : kUnits) {
    if (unit.of == dimension) names.emplace_back(unit.name);
  }
  return names;
}

const std::vector<std::string>& operation_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names{
        "flip_axis",       "set_axis",     "rotate_frame",    "bake_zero",      "set_origin",
        "set_limit",       "set_dynamics", "set_servo",       "set_joint_type", "set_inertia",
        "compute_inertia", "scale_masses", "attach_to_world", "add_mimic",      "replace_collision",
        "set_mesh_scale",  "rename_link",  "rename_joint",    "rename_robot",   "add_ros2_control"};
    for (const std::string& kind : remove_kinds()) names.push_back("remove_" + kind);
    return names;
  }();
  return kNames;
}

// Reads one operation, a map; records which keys have been read, so that the others can be reported.
class OperationReader {
 public:
  OperationReader(const YAML::Node& node, std::shared_ptr<const std::string> file)
      : node_(node), file_(std::move(file)) {}

  Operation read();

 private:
  [[nodiscard]] SourceLocation place(const YAML::Node& node) const {
    const YAML::Mark mark = node.Mark();
    if (mark.is_null()) return {file_, 0, 0, nullptr};
    return {file_, mark.line + 1, mark.column + 1, nullptr};
  }
  [[noreturn]] void fail(const YAML::Node& node, const std::string& rule, const std::string& message,
                         const std::string& fix = "") const {
    throw InputError(rule, place(node), message, fix);
  }

  void find_operation();
  void check_keys() const;
  void check_values(const OperationAction& action) const;
  void need_one_of(std::initializer_list<const char*> keys) const;
  [[noreturn]] void missing(const char* key);
  OperationAction action();
  OperationAction joint_action();
  OperationAction servo_action(const std::string& joint);
  OperationAction link_action();

  YAML::Node get(const char* key) {
    known_.emplace_back(key);
    return node_[key];
  }
  YAML::Node need(const char* key) {
    YAML::Node value = get(key);
    if (!value || value.IsNull()) missing(key);
    return value;
  }
  std::string text(const YAML::Node& node, const std::string& what) const {
    if (!node.IsScalar()) fail(node, "overlay.value", fmt::format("{} must be a string", what));
    return node.Scalar();
  }
  std::string target() const { return target_.IsNull() ? "" : text(target_, name_); }
  double quantity(const YAML::Node& node, std::string_view scalar, Dimension dimension);
  double number(const YAML::Node& node, Dimension dimension) {
    return quantity(node, text(node, "a number"), dimension);
  }
  double noted(double value, Dimension dimension, std::string_view unit);
  std::optional<double> maybe(const char* key, Dimension dimension) {
    const YAML::Node value = get(key);
    if (!value) return {};
    return number(value, dimension);
  }
  Eigen::Vector3d vector(const YAML::Node& node, Dimension dimension);
  std::optional<Eigen::Vector3d> maybe_vector(const char* key, Dimension dimension) {
    const YAML::Node value = get(key);
    if (!value) return {};
    return vector(value, dimension);
  }
  std::vector<std::string> names(const YAML::Node& node, const char* what) const;
  template <class Value, class Read>
  std::vector<std::pair<std::string, Value>> map(const char* key, Read read);

  YAML::Node node_, target_;
  std::shared_ptr<const std::string> file_;
  std::string name_;
  std::vector<std::string> known_;  // the last one is being read
  std::vector<LargeAngle> beyond_a_turn_;
};

// Lengths are recorded too: whether the joint is revolute or prismatic is unknown here.
double OperationReader::noted(double value, Dimension dimension, std::string_view unit) {
  constexpr double kTurn = 2 * std::numbers::pi * (1 + 1e-4);  // a turn may be rounded upwards
  static const std::set<std::string> kMayBeAngles{"rpy", "offset", "lower", "upper"};
  if (dimension != Dimension::position || std::abs(value) <= kTurn || !kMayBeAngles.contains(known_.back()))
    return value;
  std::string base;
  if (!unit.empty()) base = unit == "deg" || unit == "rad" ? "rad" : "m";
  beyond_a_turn_.push_back({known_.back(), value, base});
  return value;
}

double OperationReader::quantity(const YAML::Node& node, std::string_view scalar, Dimension dimension) {
  const std::size_t end = std::min(scalar.find_first_not_of("+-.0123456789eE"), scalar.size());
  const auto value = number_of(scalar.substr(0, end));
  const bool letters = end == scalar.size() || scalar[end] == ' ' ||
                       std::isalpha(static_cast<unsigned char>(scalar[end])) != 0;
  if (!value || !letters) {
    fail(node, "overlay.number", fmt::format("'{}' is not a number", scalar),
         "write it with a decimal point, optionally followed by a unit: 45 deg");
  }
  std::string_view unit = scalar.substr(end);
  unit.remove_prefix(std::min(unit.find_first_not_of(' '), unit.size()));
  if (unit.empty()) return noted(*value, dimension, unit);
  for (const Unit& known : kUnits) {
    if (known.of == dimension && known.name == unit) return noted(*value * known.factor, dimension, unit);
  }
  fail(node, "overlay.unit",
       fmt::format("'{}' is not a valid unit here{}", unit, did_you_mean(unit, units_of(dimension))));
}

Eigen::Vector3d OperationReader::vector(const YAML::Node& node, Dimension dimension) {
  Eigen::Vector3d out;
  if (node.IsSequence() && node.size() == 3) {
    for (std::size_t i = 0; i < 3; ++i) out[static_cast<Eigen::Index>(i)] = number(node[i], dimension);
    return out;
  }
  if (node.IsScalar()) {
    std::string_view rest = node.Scalar();
    double factor = 1;
    std::string_view written;
    for (const Unit& unit : kUnits) {
      const std::string ending = fmt::format(" {}", unit.name);
      if (unit.of != dimension || !rest.ends_with(ending)) continue;
      factor = unit.factor;
      written = unit.name;
      rest.remove_suffix(ending.size());
      break;
    }
    if (const auto value = vector_of(rest)) {
      out = *value * factor;
      for (const double x : out) noted(x, dimension, written);
      return out;
    }
  }
  fail(node, "overlay.vector", "three numbers are expected here",
       "write them as [0, 0, 0.25] or as 0 0 0.25");
}

std::vector<std::string> OperationReader::names(const YAML::Node& node, const char* what) const {
  if (node.IsScalar()) return {node.Scalar()};
  if (!node.IsSequence()) fail(node, "overlay.value", fmt::format("{} must be a list", what));
  std::vector<std::string> out;
  for (const YAML::Node& entry : node) out.push_back(text(entry, what));
  return out;
}

template <class Value, class Read>
std::vector<std::pair<std::string, Value>> OperationReader::map(const char* key, Read read) {
  std::vector<std::pair<std::string, Value>> out;
  const YAML::Node node = get(key);
  if (!node) return out;
  if (!node.IsMap()) fail(node, "overlay.value", fmt::format("{} must be a map: {{name: value}}", key));
  for (const auto& entry : node) out.emplace_back(text(entry.first, key), read(entry.second));
  return out;
}

void OperationReader::find_operation() {
  if (!node_.IsMap() || node_.size() == 0)
    fail(node_, "overlay.operation", "an operation is a map that begins with its name",
         "write for example '- flip_axis: Revolute 3'");
  const auto& all = operation_names();
  for (const auto& entry : node_) {
    const std::string key = text(entry.first, "an operation's name");
    if (std::ranges::find(all, key) == all.end()) continue;
    if (!name_.empty())
      fail(entry.first, "overlay.operation", fmt::format("{} and {} are two operations in one", name_, key),
           "begin the second with its own '-'");
    name_ = key;
    target_ = entry.second;
  }
  if (!name_.empty()) return;
  const YAML::Node first = node_.begin()->first;
  fail(first, "overlay.operation",
       fmt::format("'{}' is not an operation{}", first.Scalar(), did_you_mean(first.Scalar(), all)),
       "'doppel man overlay.md' lists them all");
}

void OperationReader::check_keys() const {
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    const std::string key = text(entry.first, "a key");
    if (!seen.insert(key).second)
      fail(entry.first, "overlay.duplicate_key", fmt::format("'{}' is written twice", key));
    if (key != name_ && std::ranges::find(known_, key) == known_.end())
      fail(entry.first, "overlay.unknown_key",
           fmt::format("{} has no '{}'{}", name_, key, did_you_mean(key, known_)));
  }
}

void OperationReader::missing(const char* key) {
  for (const auto& entry : node_) {  // is it there, with a typo?
    if (!entry.first.IsScalar()) continue;
    const std::string written = entry.first.Scalar();
    const std::vector<std::string> wanted{key};
    if (written != name_ && written != key && nearest_name(written, wanted))
      fail(entry.first, "overlay.unknown_key",
           fmt::format("{} has no '{}'; did you mean '{}'?", name_, written, key));
  }
  fail(node_, "overlay.missing_key", fmt::format("{} needs '{}'", name_, key),
       fmt::format("write a line '{}: ...' below it", key));
}

// Reported after the unknown keys: a typo is the more likely reason.
void OperationReader::need_one_of(std::initializer_list<const char*> keys) const {
  if (std::ranges::any_of(keys, [&](const char* key) { return node_[key].IsDefined(); })) return;
  std::string all;
  for (const char* key : keys) all += fmt::format("{}{}", all.empty() ? "" : ", ", key);
  fail(node_, "overlay.missing_key", fmt::format("{} sets nothing", name_),
       fmt::format("give at least one of {}", all));
}

void OperationReader::check_values(const OperationAction& action) const {
  if (name_ == "set_limit") need_one_of({"lower", "upper", "effort", "velocity"});
  if (name_ == "set_dynamics") need_one_of({"damping", "friction"});
  if (name_ == "set_servo")
    need_one_of({"stiffness", "damping", "armature", "friction", "viscous", "effort", "velocity", "delay",
                 "backlash", "resolution"});
  if (name_ == "set_origin") need_one_of({"xyz", "rpy"});
  if (name_ == "set_inertia") need_one_of({"mass", "com", "ixx", "ixy", "ixz", "iyy", "iyz", "izz"});
  const auto found = invalid_value_in(action);
  if (!found) return;
  fail(found->key.empty() ? target_ : node_[found->key], "overlay.nonsense",
       fmt::format("{}: {}", name_, found->message), found->fix);
}

OperationAction OperationReader::joint_action() {
  const std::string joint = target();
  if (name_ == "flip_axis") return FlipAxis{joint};
  if (name_ == "set_axis") return SetAxis{joint, vector(need("axis"), Dimension::plain)};
  if (name_ == "rotate_frame") return RotateFrame{joint, vector(need("rpy"), Dimension::position)};
  if (name_ == "bake_zero") return BakeZero{joint, number(need("offset"), Dimension::position)};
  if (name_ == "set_joint_type") return SetJointType{joint, text(need("type"), "a type")};
  if (name_ == "set_origin")
    return SetOrigin{joint, maybe_vector("xyz", Dimension::position),
                     maybe_vector("rpy", Dimension::position)};
  if (name_ == "set_limit")
    return SetLimit{joint, maybe("lower", Dimension::position), maybe("upper", Dimension::position),
                    maybe("effort", Dimension::effort), maybe("velocity", Dimension::speed)};
  if (name_ == "set_dynamics")
    return SetDynamics{joint, maybe("damping", Dimension::plain), maybe("friction", Dimension::plain)};
  if (name_ == "set_servo") return servo_action(joint);
  AddMimic mimic{joint, text(need("leader"), "a joint's name"), 1, 0};
  mimic.multiplier = maybe("multiplier", Dimension::plain).value_or(1);
  mimic.offset = maybe("offset", Dimension::position).value_or(0);
  return mimic;
}

OperationAction OperationReader::servo_action(const std::string& joint) {
  SetServo out;
  out.joint = joint;
  for (const ServoField& field : servo_fields()) {
    const std::string_view unit = field.angular;
    const Dimension dimension = unit == "rad"     ? Dimension::position
                                : unit == "rad/s" ? Dimension::speed
                                : unit == "N m"   ? Dimension::effort
                                                  : Dimension::plain;
    out.*field.value = maybe(field.key, dimension);
  }
  return out;
}

OperationAction OperationReader::link_action() {
  const std::string link = target();
  if (name_ == "set_inertia") {
    SetInertia out{link, maybe("mass", Dimension::mass), maybe_vector("com", Dimension::position), {}};
    for (const char* component : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) {
      if (const auto value = maybe(component, Dimension::plain)) out.components[component] = *value;
    }
    return out;
  }
  if (name_ == "compute_inertia")
    return ComputeInertia{link, maybe("mass", Dimension::mass), maybe("density", Dimension::density)};
  if (name_ == "attach_to_world")
    return AttachToWorld{link, maybe_vector("xyz", Dimension::position).value_or(Eigen::Vector3d::Zero()),
                         maybe_vector("rpy", Dimension::position).value_or(Eigen::Vector3d::Zero())};
  if (name_ == "set_mesh_scale") {
    const YAML::Node scale = need("scale");
    const auto even = scale.IsScalar() ? number_of(scale.Scalar()) : std::nullopt;
    return SetMeshScale{link, even ? Eigen::Vector3d::Constant(*even) : vector(scale, Dimension::plain)};
  }
  const YAML::Node by = need("by");
  static const std::vector<std::string> kShapes{"hull", "box", "decomposition", "none"};
  if (std::ranges::find(kShapes, text(by, "by")) == kShapes.end())
    fail(by, "overlay.value",
         fmt::format("collision shapes cannot be replaced by '{}'{}", by.Scalar(),
                     did_you_mean(by.Scalar(), kShapes)));
  return ReplaceCollision{link, by.Scalar()};
}

OperationAction OperationReader::action() {
  static const std::set<std::string> kOfLinks{"set_inertia", "compute_inertia", "attach_to_world",
                                              "replace_collision", "set_mesh_scale"};
  if (kOfLinks.contains(name_)) return link_action();
  if (name_ == "scale_masses") return ScaleMasses{number(target_, Dimension::mass)};
  if (name_.starts_with("rename_")) return Rename{name_.substr(7), target(), text(need("to"), "a name")};
  if (name_.starts_with("remove_")) return Remove{name_.substr(7), target()};
  if (name_ != "add_ros2_control") return joint_action();
  AddRos2Control block;
  block.name = target();
  block.plugin = text(need("plugin"), "a plugin");
  block.joints = names(need("joints"), "joints");
  const YAML::Node command = get("command_interfaces"), state = get("state_interfaces");
  block.command_interfaces =
      command ? names(command, "command_interfaces") : std::vector<std::string>{"position"};
  block.state_interfaces =
      state ? names(state, "state_interfaces") : std::vector<std::string>{"position", "velocity"};
  block.params =
      map<std::string>("params", [&](const YAML::Node& value) { return text(value, "a parameter"); });
  block.initial_values = map<double>(
      "initial_values", [&](const YAML::Node& value) { return number(value, Dimension::position); });
  return block;
}

Operation OperationReader::read() {
  find_operation();
  Operation operation;
  operation.where = place(node_);
  operation.action = action();
  operation.beyond_a_turn = std::move(beyond_a_turn_);
  if (const YAML::Node why = get("why")) operation.why = text(why, "why");
  if (const YAML::Node evidence = get("evidence")) operation.evidence = names(evidence, "evidence");
  operation.was = map<std::string>("was", [&](const YAML::Node& value) {
    if (!value.IsSequence()) return text(value, "a fingerprint's value");
    std::string joined;
    for (const YAML::Node& word : value) joined += (joined.empty() ? "" : " ") + text(word, "a number");
    return joined;
  });
  check_keys();
  check_values(operation.action);
  if (!std::holds_alternative<AttachToWorld>(operation.action) &&
      !std::holds_alternative<ScaleMasses>(operation.action) && target_name(operation.action).empty() &&
      name_ != "remove_gazebo") {
    fail(node_, "overlay.missing_key", fmt::format("{} has no target", name_),
         fmt::format("write '- {}: NAME'", name_));
  }
  return operation;
}

}  // namespace

Overlay parse_overlay(const std::string& yaml, const std::string& name) {
  Overlay overlay;
  overlay.file = name;
  const auto file = std::make_shared<const std::string>(name);
  YAML::Node root;
  try {
    root = YAML::Load(yaml);
  } catch (const YAML::Exception& problem) {
    throw InputError("overlay.yaml", {file, problem.mark.line + 1, problem.mark.column + 1, nullptr},
                     fmt::format("this is not YAML: {}", problem.msg), yaml_fix(problem.msg));
  }
  if (root.IsNull()) return overlay;
  if (!root.IsSequence()) {
    throw InputError("overlay.yaml", {file, root.Mark().line + 1, root.Mark().column + 1, nullptr},
                     "an overlay is a list of operations", "write for example '- flip_axis: Revolute 3'");
  }
  std::vector<Diagnostic> problems;
  for (const YAML::Node& node : root) {
    try {
      overlay.operations.push_back(OperationReader(node, file).read());
    } catch (const InputError& error) {
      problems.insert(problems.end(), error.diagnostics().begin(), error.diagnostics().end());
    }
  }
  if (!problems.empty()) throw InputError(std::move(problems));
  return overlay;
}

}  // namespace doppel
