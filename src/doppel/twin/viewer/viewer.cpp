#include "doppel/twin/viewer/viewer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <unordered_map>
#include <utility>

#include "doppel/base/core/names.h"
#include "doppel/ros/bus/standard_node.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/scenario/compile/robot_setup.h"
#include "doppel/scenario/compile/simulated_hardware.h"
#include "doppel/scenario/resolve/open_target.h"
#include "doppel/twin/arms/arm_services.h"
#include "doppel/twin/loop/state_publisher.h"
#include "doppel/twin/viewer/detail/drawable.h"

namespace doppel {
namespace {

constexpr const char* kCommand = "joint_command";
constexpr const char* kViewerLogOrigin = "joint_state_publisher";
constexpr Duration kIdlePublishPeriod{100'000'000};  // between two publications while nothing moves
constexpr double kClampSlack = 1e-6;                 // rad or m: a limit written with six digits
constexpr std::size_t kMaxWarnings = 50;             // so that unknown names in commands cannot fill the log

// A joint's position clamped to its limits; for a continuous joint, within one turn.
double allowed(const ModelJoint& joint, double position) {
  if (joint.type == JointType::continuous) return std::remainder(position, 2 * std::numbers::pi);
  return std::clamp(position, joint.lower, joint.upper);
}

}  // namespace

// The compiled files, before anything is on the bus. Outside of the anonymous namespace, because it is a
// member of classes with external linkage.
struct ViewerPicture {
  ViewerPicture(const Scenario& scenario, Diagnostics& diagnostics) {
    PackageResolver resolver;
    ExpandedTarget read = expand_target(scenario, scenario.robots.front(), resolver, diagnostics);
    Diagnostics found;
    target = std::move(read.target);
    expanded = std::move(read.description);
    description.robot = read_description(expanded, resolver, found);
    make_drawable(found, diagnostics);
    description.files = expanded.files;
    model = std::make_shared<const Model>(compile_model(description.robot, BaseKind::fixed, diagnostics));
    add_ros_parameters(scenario.ros, parameters);
    start = model->neutral();
    apply_initial_values(description.robot, *model, start, diagnostics);
  }

  Target target;
  ExpandedDescription expanded;
  LoadedDescription description;
  std::shared_ptr<const Model> model;
  ParameterFile parameters;  // of the command line
  Eigen::VectorXd start;     // [model->nq]
};

struct Viewer::Replacement {
  std::unique_ptr<ViewerPicture> picture;
};

struct Viewer::Impl {
  Impl(Scenario the_scenario, const Log& the_log, Diagnostics& diagnostics)
      : shared_scenario(std::make_shared<const Scenario>(std::move(the_scenario))), log(the_log) {
    states = node.advertise<sensor_msgs::msg::JointState>("joint_states");
    make_standard(node);
    arms = std::make_unique<ArmServices>(bus, log, "", [this] { return snapshot(); });
    node.subscribe<sensor_msgs::msg::JointState>(
        kCommand, [this](const sensor_msgs::msg::JointState& command) { take(command); });
    show(std::make_unique<ViewerPicture>(scenario, diagnostics));
  }

  // The robot stands alone at its commanded positions.
  [[nodiscard]] std::optional<ArmSnapshot> snapshot() const {
    ArmSnapshot out;
    out.robot = robot;
    out.q = q;
    return out;
  }

  void show(std::unique_ptr<ViewerPicture> fresh) {
    publisher.reset();
    picture = std::move(fresh);
    auto described = std::make_shared<ArmRobot>();
    described->owner = picture;
    described->description = &picture->description.robot;
    described->target = &picture->target;
    described->model = picture->model;
    robot = std::move(described);
    const Model& model = *picture->model;
    q = picture->start;
    publisher = std::make_unique<StatePublisher>(
        bus, picture->description.robot, picture->model,
        StatePublisher::Options{.file = &picture->parameters, .statics = statics});
    shown.name = model.scalar_joint_names();
    shown.position.assign(shown.name.size(), 0.0);
    joints.clear();
    for (std::size_t i = 0; i < model.joints.size(); ++i)
      joints.emplace(model.joints[i].name, static_cast<int>(i));
    warned.clear();
    latched_due = changed = true;
  }

  void replace(std::unique_ptr<ViewerPicture> fresh) {
    const std::shared_ptr<const ViewerPicture> old = std::move(picture);
    const Eigen::VectorXd stood = q;
    show(std::move(fresh));
    for (const ModelJoint& joint : picture->model->joints) {
      const int index = old->model->find_joint(joint.name);
      if (index < 0 || !joint.scalar()) continue;
      const ModelJoint& before = old->model->joints[static_cast<std::size_t>(index)];
      if (before.scalar() && (before.type == JointType::prismatic) == (joint.type == JointType::prismatic))
        q[joint.q] = allowed(joint, stood[before.q]);
    }
    picture->model->apply_mimics(q);
  }

  void warn_once(const std::string& key, const std::string& text) {
    if (warned.size() >= kMaxWarnings || !warned.insert(key).second) return;
    log.warning(kViewerLogOrigin, fmt::format("{}: {}", kCommand, text));
    if (warned.size() == kMaxWarnings)
      log.warning(kViewerLogOrigin, fmt::format("{}; further cases are not reported", kCommand));
  }

  // The joint that a command sets; nullptr: none, and the reason was reported.
  const ModelJoint* find(const std::string& name) {
    const auto found = joints.find(name);
    if (found == joints.end()) {
      warn_once(name, fmt::format("the robot has no joint '{}'{}", name,
                                  did_you_mean(name, picture->model->driven_joint_names())));
      return nullptr;
    }
    const ModelJoint& joint = picture->model->joints[static_cast<std::size_t>(found->second)];
    if (!joint.scalar()) {
      warn_once(name, fmt::format("the joint '{}' does not have a single position", name));
      return nullptr;
    }
    if (joint.mimics()) {
      const auto& leader = picture->model->joints[static_cast<std::size_t>(joint.mimic_leader)];
      warn_once(name, fmt::format("the joint '{}' mimics '{}'; set that one", name, leader.name));
      return nullptr;
    }
    return &joint;
  }

  void take(const sensor_msgs::msg::JointState& command) {
    if (command.position.size() != command.name.size()) {
      warn_once("", fmt::format("{} names with {} positions; the message is ignored", command.name.size(),
                                command.position.size()));
      return;
    }
    for (std::size_t i = 0; i < command.name.size(); ++i) {
      const ModelJoint* joint = find(command.name[i]);
      if (joint == nullptr) continue;
      if (!std::isfinite(command.position[i])) {
        warn_once(joint->name + " is finite",
                  fmt::format("the position of '{}' is {}, which is not finite; it keeps its position",
                              joint->name, command.position[i]));
        continue;
      }
      const double position = allowed(*joint, command.position[i]);
      if (joint->type != JointType::continuous && std::abs(position - command.position[i]) > kClampSlack) {
        warn_once(
            joint->name + " is inside its limits",
            fmt::format(
                "the position {:.6g} of '{}' is outside its limits {:.6g} to {:.6g} {}; clamped to {:.6g}",
                command.position[i], joint->name, joint->lower, joint->upper,
                joint->type == JointType::prismatic ? "m" : "rad", position));
      }
      changed = changed || q[joint->q] != position;
      q[joint->q] = position;
    }
    if (changed) picture->model->apply_mimics(q);
  }

  void publish(Time now) {
    shown.header.stamp = to_time_msg(now);
    std::size_t row = 0;
    for (const ModelJoint& joint : picture->model->joints) {
      if (joint.scalar()) shown.position[row++] = q[joint.q];
    }
    states.publish(shown, now);
    publisher->publish_transforms(now, q);
    changed = false;
    published = now;
  }

  void step(Time now) {
    bus.set_now(now);
    bus.spin();
    if (std::exchange(latched_due, false)) publisher->publish_latched(now);
    // Wall-clock time may be set back.
    if (changed || now < published || now - published >= kIdlePublishPeriod) publish(now);
  }

  const std::shared_ptr<const Scenario> shared_scenario;  // with builds that may outlive the viewer
  const Scenario& scenario = *shared_scenario;
  const std::shared_ptr<StaticTransforms> statics = static_transforms(scenario.transforms);
  const Log& log;
  Bus bus{{.names = scenario.ros.names, .sim_time = false}};
  Node node{bus, "/joint_state_publisher"};
  Publisher<sensor_msgs::msg::JointState> states;
  std::shared_ptr<const ViewerPicture> picture;  // shared with the threads of `arms`
  std::shared_ptr<const ArmRobot> robot;
  std::unique_ptr<StatePublisher> publisher;
  std::unordered_map<std::string, int> joints;  // index by name
  std::set<std::string> warned;                 // warnings that were already logged
  Eigen::VectorXd q;
  sensor_msgs::msg::JointState shown;
  bool changed = true, latched_due = true;
  Time published{};
  std::unique_ptr<ArmServices> arms;
};

Viewer::Viewer(const Scenario& scenario, const Log& log, Diagnostics& diagnostics)
    : impl_(std::make_unique<Impl>(scenario, log, diagnostics)) {}

Viewer::~Viewer() = default;

void Viewer::step(Time now) {
  impl_->step(now);
}

std::shared_ptr<const Scenario> Viewer::scenario() const {
  return impl_->shared_scenario;
}

std::shared_ptr<Viewer::Replacement> Viewer::prepare(const Scenario& scenario, Diagnostics& diagnostics) {
  auto fresh = std::make_shared<Replacement>();
  fresh->picture = std::make_unique<ViewerPicture>(scenario, diagnostics);
  return fresh;
}

void Viewer::replace(const std::shared_ptr<Replacement>& replacement) {
  impl_->replace(std::move(replacement->picture));
}

const RobotDescription& Viewer::description(const Replacement& replacement) {
  return replacement.picture->description.robot;
}

const ExpandedDescription& Viewer::expanded(const Replacement& replacement) {
  return replacement.picture->expanded;
}

std::vector<std::filesystem::path> Viewer::files() const {
  return files_of(impl_->picture->target, impl_->picture->description);
}

const Model& Viewer::model() const {
  return *impl_->picture->model;
}
const RobotDescription& Viewer::description() const {
  return impl_->picture->description.robot;
}
const ExpandedDescription& Viewer::expanded() const {
  return impl_->picture->expanded;
}
const Eigen::VectorXd& Viewer::q() const {
  return impl_->q;
}
Bus& Viewer::bus() {
  return impl_->bus;
}

}  // namespace doppel
