// A mobile base as others have described it: whether it stands on its wheels, drives 1 m and turns by 90 degrees by
// its own controller, and where its odometry says that it is. The truth decides when it has arrived.
//   build/bin/bench_drive_base TARGET [name:=value ...] [--controllers FILE]
// prints one JSON object; exit code 2 if the robot is refused, 1 if the simulation diverges. tools/sweep bases runs it for many robots.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/nav_msgs.h"
#include "doppel/scenario/compile/rolling_report.h"
#include "doppel/scenario/resolve/controllers_file.h"
#include "doppel/twin/assembly/twin.h"

namespace {

using doppel::geometry_msgs::msg::Twist;
using doppel::geometry_msgs::msg::TwistStamped;
using nlohmann::json;

constexpr double kSpeed = 0.25, kTurn = 0.5;  // m/s, rad/s
constexpr double kMetre = 1.0, kQuarter = std::numbers::pi / 2;
constexpr double kCommandPeriod = 0.05;  // s
constexpr double kLongest = 90.0;        // s, of one movement
constexpr double kArrived = 0.01;        // m or rad before the end
constexpr double kSlowdown = 0.4;        // m or rad before the end, from where it drives slower
constexpr double kSlowest = 0.1;         // of the speed
constexpr double kRamp = 1.0;            // s, to the full speed
constexpr double kStandardGravity = 9.80665;

struct Place {
  double x = 0, y = 0, yaw = 0;  // m, rad; the yaw counts turns
};

// `there` as seen from `here`.
Place relative(const Place& here, const Place& there) {
  const double c = std::cos(here.yaw), s = std::sin(here.yaw), dx = there.x - here.x, dy = there.y - here.y;
  return {c * dx + s * dy, -s * dx + c * dy, there.yaw - here.yaw};
}

json shown(const Place& place) {
  return {{"x", place.x}, {"y", place.y}, {"degrees", place.yaw * 180 / std::numbers::pi}};
}

class DrivenBase {
 public:
  DrivenBase(const doppel::Scenario& scenario, json& report) : report_(report) {
    log_.add_sink([this](const doppel::LogLine& line) {
      if (line.severity != doppel::Severity::note) report_["log"].push_back(line.origin + ": " + line.text);
    });
    twin_.emplace(scenario, log_, diagnostics_);
    edge_ = twin_->bus().attach("driver");
    for (const doppel::Diagnostic& d : diagnostics_.all())
      report_["diagnostics"].push_back({{"rule", d.rule}, {"message", d.message}});
    for (const auto& controller : twin_->robot().controller_manager().controllers()) {
      if (controller.state != doppel::ControllerState::active) continue;
      report_["controllers"].push_back(controller.type);
      steers_ = steers_ || controller.type.find("steering") != std::string::npos;
    }
  }

  void stand() {
    run(1.0);
    const auto& instance = twin_->robot().instance();
    const doppel::RollingReport rolling = doppel::report_rolling(instance);
    double load = 0;
    int wheels = 0, casters = 0;
    for (const doppel::RollingLoad& part : rolling.parts) {
      ++(part.part.kind == doppel::RollingPart::Kind::wheel ? wheels : casters);
      load += part.load;
    }
    report_["wheels"] = wheels;
    report_["casters"] = casters;
    report_["load"] = load / (kStandardGravity * instance.model().total_mass);
    report_["mass"] = instance.model().total_mass;
    report_["rolling"] = to_string(rolling);
    const Place before = truth();
    run(1.0);
    const Place moved = relative(before, truth());
    report_["creep"] = std::hypot(moved.x, moved.y);
    upright();
  }

  // Finds the topics of the base; false: no node reads velocities.
  bool find_topics() {
    std::vector<doppel::TopicInfo> inputs;
    for (const doppel::TopicInfo& topic : twin_->bus().topics()) {
      const bool drives = topic.type == Twist::kType || topic.type == TwistStamped::kType;
      if (drives && std::ranges::any_of(topic.subscribers, [&](const auto& s) { return is_active(s.node); }))
        inputs.push_back(topic);
      if (topic.type == doppel::nav_msgs::msg::Odometry::kType && !topic.publishers.empty() &&
          topic.name.find("ground_truth") == std::string::npos) {
        edge_->subscribe(topic.id);
        odometry_topic_ = topic.id;
        report_["odometry_topic"] = topic.name;
      }
    }
    if (inputs.empty()) return false;
    input_ = inputs.front();
    for (const doppel::TopicInfo& topic : inputs) {
      if (topic.name.ends_with("cmd_vel")) input_ = topic;
    }
    report_["command_topic"] = input_.name;
    report_["driven_by"] = origin_of(input_.subscribers.front().node);
    return true;
  }

  void drive() {
    command({}, 0.2);  // odometry begins with the first command
    const Place start = truth(), odometry = said_;
    const auto ahead = [&] { return relative(start, truth()).x; };
    drive_until({{kSpeed, 0, 0}, {}}, [&] { return kMetre - ahead(); });
    report_["straight"] = {{"truth", shown(relative(start, truth()))},
                           {"odometry", shown(relative(odometry, said_))}};
    upright();
  }

  void turn() {
    const Place start = truth(), odometry = said_;
    const auto turned = [&] { return relative(start, truth()).yaw; };
    const bool on_spot = !steers_ && (command({{}, {0, 0, kTurn}}, 2.0), std::abs(turned()) > 0.15);
    report_["turns_on_spot"] = on_spot;
    const Twist twist = on_spot ? Twist{{}, {0, 0, kTurn}} : Twist{{kSpeed, 0, 0}, {0, 0, kTurn / 2}};
    drive_until(twist, [&] { return kQuarter - std::abs(turned()); });
    report_["turn"] = {{"truth", shown(relative(start, truth()))},
                       {"odometry", shown(relative(odometry, said_))}};
    upright();
  }

 private:
  void run(double seconds) {
    const doppel::Time end = twin_->now() + doppel::from_seconds(seconds);
    while (twin_->now() < end) {
      twin_->between_steps();
      twin_->step();
      if (twin_->diverged())
        throw std::runtime_error(
            fmt::format("the simulation diverged after {:.3f} s", doppel::to_seconds(twin_->now())));
    }
    truth();
    doppel::Edge::Incoming incoming;
    doppel::nav_msgs::msg::Odometry message;
    while (edge_->next(incoming)) {
      if (!odometry_topic_ || incoming.topic != *odometry_topic_ || !doppel::from_cdr(incoming.cdr, message))
        continue;
      const auto& pose = message.pose.pose;
      const double yaw = 2 * std::atan2(pose.orientation.z, pose.orientation.w);
      said_ = {pose.position.x, pose.position.y,
               said_.yaw + std::remainder(yaw - said_.yaw, 2 * std::numbers::pi)};
    }
  }
  Place truth() {
    const doppel::Pose X = twin_->robot().instance().base_pose();
    const double yaw = std::atan2(X.linear()(1, 0), X.linear()(0, 0));
    yaw_ += std::remainder(yaw - yaw_, 2 * std::numbers::pi);
    return {X.translation().x(), X.translation().y(), yaw_};
  }
  void upright() {
    const double tilt = std::acos(std::min(1.0, twin_->robot().instance().base_pose().linear()(2, 2)));
    report_["tilt_degrees"] = std::max(report_.value("tilt_degrees", 0.0), tilt * 180 / std::numbers::pi);
  }
  void command(const Twist& twist, double seconds) {
    const doppel::Time end = twin_->now() + doppel::from_seconds(seconds);
    while (twin_->now() < end) {
      TwistStamped stamped;
      stamped.twist = twist;
      const doppel::Bytes cdr = input_.type == Twist::kType ? doppel::to_cdr(twist) : doppel::to_cdr(stamped);
      if (const doppel::Status sent = edge_->publish("/driver", input_.name, input_.type, cdr); !sent)
        report_["log"].push_back(sent.why());
      run(kCommandPeriod);
    }
  }
  // Slower towards both ends: a base with low limits of its acceleration does not go too far, and one with its mass
  // near the axle does not tip over. left: m or rad.
  template <typename Left>
  void drive_until(const Twist& twist, const Left& left) {
    const doppel::Time begin = twin_->now(), end = begin + doppel::from_seconds(kLongest);
    while (left() > kArrived && twin_->now() < end) {
      const double begun = doppel::to_seconds(twin_->now() - begin) / kRamp;
      const double part = std::clamp(std::min(begun, left() / kSlowdown), kSlowest, 1.0);
      command({{part * twist.linear.x, 0, 0}, {0, 0, part * twist.angular.z}}, kCommandPeriod);
    }
    command({}, 1.5);
  }

  bool is_active(const std::string& node) const {
    const auto controllers = twin_->robot().controller_manager().controllers();
    return std::ranges::any_of(controllers, [&](const doppel::ControllerView& controller) {
      return node.ends_with("/" + controller.name) && controller.state == doppel::ControllerState::active;
    });
  }
  // Where the controller was declared: the file's path, "plugin" for one in place of a Gazebo plugin, "generated".
  std::string origin_of(const std::string& node) const {
    const auto& setup = twin_->robot().machine().setup();
    const std::string name = node.substr(node.find_last_of('/') + 1);
    for (const doppel::DeclaredController& controller :
         doppel::controllers_in(setup.controllers).controllers) {
      if (controller.name != name) continue;
      const auto& file = controller.where.file;
      if (file && !file->starts_with("<")) return *file;
    }
    const bool mapped = std::ranges::any_of(diagnostics_.all(), [&](const doppel::Diagnostic& d) {
      return d.rule == "up.base_plugin" &&
             d.message.find(fmt::format("controller '{}'", name)) != std::string::npos;
    });
    return mapped ? "plugin" : "generated";
  }

  json& report_;
  doppel::Log log_;
  doppel::Diagnostics diagnostics_;
  std::optional<doppel::Twin> twin_;
  std::unique_ptr<doppel::Edge> edge_;
  doppel::TopicInfo input_;
  std::optional<doppel::TopicId> odometry_topic_;
  Place said_;  // by the odometry
  double yaw_ = 0;
  bool steers_ = false;  // it cannot turn on the spot
};

}  // namespace

int main(int argc, char** argv) {
  doppel::Scenario scenario;
  scenario.bundled_robots = DOPPEL_ROBOTS;
  doppel::WorldRobot& robot = scenario.robots.emplace_back();
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const std::size_t assigned = word.find(":=");
    if (word == "--controllers" && i + 1 < argc) {
      robot.controllers = {argv[++i]};
    } else if (assigned != std::string::npos) {
      robot.arguments.emplace_back(word.substr(0, assigned), word.substr(assigned + 2));
    } else {
      robot.target = word;
    }
  }
  json report{{"log", json::array()}, {"diagnostics", json::array()}, {"controllers", json::array()}};
  int code = 0;
  try {
    DrivenBase base(scenario, report);
    base.stand();
    if (base.find_topics()) {
      base.drive();
      base.turn();
    }
  } catch (const doppel::InputError& error) {
    report["refused"] = error.what();
    code = 2;
  } catch (const std::runtime_error& error) {
    report["failed"] = error.what();
    code = 1;
  }
  fmt::print("{}\n", report.dump(2));
  return code;
}
