#pragma once
// Calls of the simulator's services with extreme numbers, chosen by bytes: for the fuzz target and for a test
// with seeded bytes. A twin that is called so stays finite, or is paused with a cause, and goes on after a
// reset.

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "doppel/twin/assembly/twin.h"
#include "doppel/twin/loop/time_control.h"

namespace doppel::test {

// In `request`, # is a number, % an integer, @ the name of a joint, link or object.
struct ExtremeCall {
  const char* service;
  const char* type;
  const char* request;
};

inline constexpr std::array kExtremeCalls{
    ExtremeCall{"/gazebo/apply_joint_effort", "gazebo_msgs/srv/ApplyJointEffort",
                "{joint_name: '@', effort: #, start_time: {sec: %}, duration: {sec: %}}"},
    ExtremeCall{"/gazebo/apply_link_wrench", "gazebo_msgs/srv/ApplyLinkWrench",
                "{link_name: '@', reference_point: {x: #}, wrench: {force: {x: #, z: #}, torque: {y: #}}, "
                "duration: {sec: %}}"},
    ExtremeCall{"/gazebo/apply_body_wrench", "gazebo_msgs/srv/ApplyBodyWrench",
                "{body_name: '@', reference_frame: '@', wrench: {force: {y: #}, torque: {x: #, z: #}}, "
                "duration: {sec: %}}"},
    ExtremeCall{"/gazebo/set_state", "doppel_msgs/srv/SetState",
                "{names: ['@'], positions: [#], velocities: [#]}"},
    ExtremeCall{"/gazebo/set_model_configuration", "gazebo_msgs/srv/SetModelConfiguration",
                "{model_name: '@', joint_names: ['@'], joint_positions: [#]}"},
    ExtremeCall{
        "/gazebo/set_entity_state", "gazebo_msgs/srv/SetEntityState",
        "{state: {name: '@', reference_frame: '@', pose: {position: {x: #, z: #}, orientation: {w: 1}}, "
        "twist: {linear: {x: #}, angular: {y: #, z: #}}}}"},
    ExtremeCall{"/gazebo/set_model_state", "gazebo_msgs/srv/SetModelState",
                "{model_state: {model_name: '@', pose: {position: {y: #}, orientation: {x: #, w: #}}, twist: "
                "{angular: {x: #}}}}"},
    ExtremeCall{"/gazebo/set_speed", "doppel_msgs/srv/SetSpeed", "{factor: #}"},
    ExtremeCall{"/gazebo/pause_physics", "std_srvs/srv/Empty", "{}"},
    ExtremeCall{"/gazebo/unpause_physics", "std_srvs/srv/Empty", "{}"},
    ExtremeCall{"/gazebo/step", "doppel_msgs/srv/Step", "{steps: 7}"},
    ExtremeCall{"/world/empty/control", "ros_gz_interfaces/srv/ControlWorld",
                "{world_control: {run_to_sim_time: {sec: %}}}"},
    ExtremeCall{"/world/empty/set_pose", "ros_gz_interfaces/srv/SetEntityPose",
                "{entity: {name: '@'}, pose: {position: {x: #, y: #, z: #}, orientation: {w: 1}}}"},
    ExtremeCall{
        "/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
        "{name: box, initial_pose: {position: {x: #, z: #}, orientation: {w: 1}}, xml: \"<sdf "
        "version='1.7'><model name='box'><link name='l'><inertial><mass>#</mass></inertial><collision "
        "name='c'><geometry><box><size># # #</size></box></geometry></collision></link></model></sdf>\"}"},
    ExtremeCall{
        "/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
        "{name: rod, initial_pose: {position: {y: #}, orientation: {w: 1}}, xml: \"<robot name='rod'><link "
        "name='l'><inertial><mass value='#'/><inertia ixx='#' iyy='#' izz='#' ixy='0' ixz='0' iyz='0'/>"
        "</inertial><collision><geometry><cylinder radius='#' length='#'/></geometry></collision></link>"
        "</robot>\"}"},
    ExtremeCall{"/world/empty/create", "ros_gz_interfaces/srv/SpawnEntity",
                "{entity_factory: {clone_name: '@', name: twin_of_it, allow_renaming: true, pose: {position: "
                "{x: #, z: "
                "#}, orientation: {w: 1}}}}"},
    ExtremeCall{"/attach", "gazebo_ros_link_attacher/srv/Attach",
                "{model_name_1: '@', link_name_1: link, model_name_2: '@', link_name_2: l}"},
    ExtremeCall{"/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: '@'}"},
};

// The spelling of YAML.
inline constexpr std::array kExtremeNumbers{
    ".nan",  ".inf", "-.inf", "0",    "-0.0", "5e-324", "1e300", "-1e300", "1e20",    "-1e20", "1e9",
    "-1e9",  "1e6",  "-1e6",  "1e4",  "-1e4", "300",    "-300",  "30",     "-3",      "1",     "0.3",
    "-0.02", "1e-3", "1e-4",  "1e-6", "1e-9", "-1",     "1000",  "0.1",    "1.7e308", "2"};
inline constexpr std::array kExtremeIntegers{"0", "1", "-1", "10", "2147483647", "-2147483648"};
inline constexpr std::array kExtremeNames{"j1",  "j2",  "j3", "arm",   "ball",
                                          "box", "rod", "",   "world", "dyn4_rotor"};

class ExtremeCalls {
 public:
  explicit ExtremeCalls(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
    Scenario scenario;
    scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
    scenario.robots = {{.target = "lab_arm"}};
    twin_ = std::make_unique<Twin>(scenario, log_, diagnostics_);
    twin_->time_control().pauses_at_divergence = true;
    edge_ = twin_->bus().attach("extremes");
    call("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
         "{name: ball, initial_pose: {position: {x: 1, z: 0.2}, orientation: {w: 1}}, xml: \"<sdf "
         "version='1.7'><model "
         "name='ball'><link name='link'><collision "
         "name='c'><geometry><sphere><radius>0.05</radius></sphere></geometry>"
         "</collision></link></model></sdf>\"}");
  }

  // Empty: the twin has survived all calls; else the call after which it is not as it should be, and how.
  std::string run() {
    while (!bytes_.empty()) {
      const ExtremeCall& what = kExtremeCalls[next() % kExtremeCalls.size()];
      const std::string request = filled(what.request);
      call(what.service, what.type, request);
      loop();
      if (const std::string problem = find_problem(); !problem.empty())
        return fmt::format("{} {}: {}", what.service, request, problem);
    }
    call("/gazebo/reset_simulation", "std_srvs/srv/Empty", "{}");
    twin_->between_steps();
    return twin_->diverged() || !twin_->time_control().divergence.empty()
               ? "a reset does not end the divergence"
               : "";
  }
  [[nodiscard]] int divergences() const { return divergences_; }

 private:
  std::uint8_t next() {
    if (bytes_.empty()) return 0;
    const std::uint8_t out = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return out;
  }

  std::string filled(const char* request) {
    std::string out;
    for (const char* c = request; *c != 0; ++c) {
      if (*c == '#') {
        out += kExtremeNumbers[next() % kExtremeNumbers.size()];
      } else if (*c == '%') {
        out += kExtremeIntegers[next() % kExtremeIntegers.size()];
      } else if (*c == '@') {
        out += kExtremeNames[next() % kExtremeNames.size()];
      } else {
        out += *c;
      }
    }
    return out;
  }

  void call(const std::string& service, const std::string& type, const std::string& yaml) {
    const ServiceSupport* const support = find_service(type);
    Bytes request;
    if (support == nullptr || !support->request->yaml_to_cdr(yaml, request).ok()) return;
    edge_->call(service, request, [](const Status&, const Bytes&) {});
    twin_->between_steps();
  }

  // Does the same as the runner, with few steps.
  void loop() {
    TimeControl& time = twin_->time_control();
    for (int i = 0; i < 8; ++i) {
      twin_->between_steps();
      if (time.paused && time.steps_owed == 0) continue;
      if (time.paused) --time.steps_owed;
      twin_->step();
    }
    twin_->between_steps();
  }

  std::string find_problem() {
    const bool diverged = twin_->diverged();
    if (diverged != !twin_->time_control().divergence.empty()) return "the divergence is not reported";
    if (diverged && !twin_->time_control().paused) return "it has diverged and is not paused";
    for (std::size_t i = 0; i < twin_->engine().world().instances().size(); ++i) {
      const Instance instance = twin_->engine().instance(static_cast<int>(i));
      for (const auto& values : {instance.q(), instance.v()}) {
        for (const double value : values) {
          if (!std::isfinite(value)) return "the state of " + instance.name() + " is not finite";
        }
      }
      if (!instance.base_pose().matrix().allFinite())
        return "the pose of " + instance.name() + " is not finite";
    }
    if (!diverged) return "";
    ++divergences_;
    call("/gazebo/reset_simulation", "std_srvs/srv/Empty", "{}");
    twin_->between_steps();
    return twin_->diverged() ? "a reset does not end the divergence" : "";
  }

  std::span<const std::uint8_t> bytes_;
  int divergences_ = 0;
  Log log_;
  Diagnostics diagnostics_;
  std::unique_ptr<Twin> twin_;
  std::unique_ptr<Edge> edge_;
};

}  // namespace doppel::test
