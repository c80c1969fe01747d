#pragma once
// robot_state_publisher: robot_description and /tf_static (latched), and /tf. TF is computed from the true
// state of every joint, mimics included, and not from joint_states.
//
// A robot with a namespace NS has its node and robot_description in it. Its transforms are on /tf, where all
// robots share one tree and its frames have the prefix "NS/", and on /NS/tf and /NS/tf_static with the frames
// of the description (TfTopics). Frames and names by REP 105.
//
// While a controller publishes the transform odom -> root of a mobile base, the true pose of the root is left out
// of that topic, because a frame has one parent; it remains on ground_truth/odom (detail/ground_truth.h).

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/control/manager/controller.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/physics/contract/world_robot.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/parameter_file.h"
#include "doppel/ros/messages/distro.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "doppel/scenario/compile/robot_sensors.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

// The static transforms of each robot of a bus, by namespace: a latched topic keeps one message, so that each
// message has to contain those of all robots. Of two publishers with the same namespace the last one is used.
struct StaticTransformsOf {
  const void* publisher = nullptr;
  std::vector<geometry_msgs::msg::TransformStamped> transforms;
};
using StaticTransforms = std::map<std::string, StaticTransformsOf>;
// With those of a scenario, which belong to no robot.
DOPPEL_API std::shared_ptr<StaticTransforms> static_transforms(
    const std::vector<StaticTransform>& transforms);

// The distributions in which RViz asks a service for meshes that the description names as its files
// (session/live/resource_service.h): the description in that form is robot_description_remote.
inline constexpr DistroRange kHaveResourceService{Distro::lyrical, kLastDistro};
inline constexpr const char* kResourceService = "/resource_provider";

class DOPPEL_API StatePublisher {
 public:
  struct Options {
    std::string name_space = {};          // "left"; empty: none
    TfTopics tf = TfTopics::both;         // of a robot with a namespace
    Pose X_WR = Pose::Identity();         // the root link in the world
    const ParameterFile* file = nullptr;  // with the node's parameters; nullptr: none
    std::vector<FixedFrame> frames = {};  // of sensors, on links
    std::shared_ptr<StaticTransforms> statics = std::make_shared<StaticTransforms>();  // of the bus
  };
  // Without a link "world", /tf_static has the root link in a frame "world"; with one that the world file
  // moves, the engine's world is the frame "ground". In a tree with other robots "world" is always the
  // engine's world. Throws InputError for an invalid parameter.
  StatePublisher(Bus& bus, const RobotDescription& robot, std::shared_ptr<const Model> model,
                 const Options& options);
  ~StatePublisher();
  StatePublisher(const StatePublisher&) = delete;
  StatePublisher& operator=(const StatePublisher&) = delete;

  // In the loop: no allocation, no lock, no throw. q: [model.nq].
  void publish_transforms(Time now, const Eigen::Ref<const Eigen::VectorXd>& q);
  // Between steps: the controller's transform of the root link (ControllerManager::base_transform); nullptr: none.
  void follow_base_transform(const BaseTransform* base, Time now);
  // Between steps, at the start and after a reset of time.
  void publish_latched(Time now);
  // The period of /tf; zero: at every step.
  [[nodiscard]] Duration period() const { return period_; }

 private:
  // One topic of transforms, with its latched one.
  struct Tree {
    Publisher<tf2_msgs::msg::TFMessage> tf = {}, tf_static = {};
    tf2_msgs::msg::TFMessage moving = {}, fixed = {};
    bool shared = false;    // with other robots; frames have the prefix "NS/"
    bool separate = false;  // /NS/tf
    std::string prefix = {};
    std::string topic = {};  // of tf, resolved
    // The transform of the root link, while a controller publishes another one. In `moving` or `fixed` it is the
    // first.
    std::optional<geometry_msgs::msg::TransformStamped> withheld = std::nullopt;
  };
  [[nodiscard]] bool floats() const;
  void give_back_root(Tree& tree) const;
  [[nodiscard]] bool is_root_of(const Tree& tree, const BaseTransform* base) const;
  void add_tree(Tree tree, const std::string& tf, const std::string& tf_static, const Pose& X_WR);
  void declare_parameters(const RobotDescription& robot, ParameterOverrides& parameters);
  static void collect_root(Tree& tree, const Model& model, const Pose& X_WR);
  void set_frame_prefix(const std::string& prefix);

  const std::shared_ptr<const Model> model_;
  const std::string name_space_;
  const std::vector<FixedFrame> frames_;
  const std::shared_ptr<StaticTransforms> statics_;
  Node node_;
  Publisher<std_msgs::msg::String> description_;
  std_msgs::msg::String description_message_;
  Publisher<std_msgs::msg::String> remote_description_;  // kHaveResourceService
  std_msgs::msg::String remote_description_message_;
  std::vector<Tree> trees_;
  Duration period_{20'000'000};
  std::vector<std::size_t> moving_joints_;
};

}  // namespace doppel
