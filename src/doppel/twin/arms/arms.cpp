#include "doppel/twin/arms/arms.h"

#include <algorithm>
#include <memory>
#include <optional>

#include "doppel/scenario/resolve/joint_groups.h"
#include "doppel/twin/arms/arm_services.h"
#include "doppel/twin/loop/twin_core.h"

namespace doppel {
namespace {

std::shared_ptr<const ArmRobot> arm_robot(const std::shared_ptr<const CompiledRobot>& machine) {
  auto out = std::make_shared<ArmRobot>();
  out->owner = machine;
  out->description = &machine->description();
  out->target = machine->from_text() ? nullptr : &machine->setup().target;
  out->model = machine->shared_model();
  out->controllers = joint_groups(controllers_in(machine->setup().controllers));
  out->name_space = machine->name_space();
  out->base_link = machine->instance().base_link();
  return out;
}

// The services of one robot, with what stays the same until it is reloaded.
class RobotArms {
 public:
  RobotArms(TwinCore& core, const std::string& name_space)
      : core_(core),
        name_space_(name_space),
        services_(core.bus(), core.log(), name_space, [this] { return snapshot(); }) {}

  [[nodiscard]] const std::string& name_space() const { return name_space_; }

 private:
  std::optional<ArmSnapshot> snapshot() {
    const TwinRobot* const robot = core_.find(name_space_);
    if (robot == nullptr) return std::nullopt;
    if (robot_ == nullptr || robot_->owner != robot->shared_machine())
      robot_ = arm_robot(robot->shared_machine());
    ArmSnapshot out;
    out.robot = robot_;
    const Engine& engine = core_.engine();
    out.world = engine.compiled();
    out.instance = robot->instance().index();
    const auto q = robot->instance().q();
    out.q = Eigen::Map<const Eigen::VectorXd>(q.data(), static_cast<Eigen::Index>(q.size()));
    out.attachments = engine.attachments();
    for (int i = 0; i < static_cast<int>(out.world->instances().size()); ++i) {
      const Instance instance = engine.instance(i);
      std::vector<Pose>& poses = out.X_WL.emplace_back();
      for (int link = 0; link < static_cast<int>(instance.model().links.size()); ++link)
        poses.push_back(instance.link_pose(link));
    }
    return out;
  }

  TwinCore& core_;
  std::string name_space_;
  std::shared_ptr<const ArmRobot> robot_;
  ArmServices services_;
};

class Arms : public Tickable {
 public:
  explicit Arms(TwinCore& core) : core_(core) { update(); }

  void instances_changed() override { update(); }

 private:
  // A set of services for each robot that is there.
  void update() {
    std::erase_if(robots_, [this](const std::unique_ptr<RobotArms>& arms) {
      return core_.find(arms->name_space()) == nullptr;
    });
    for (const auto& robot : core_.robots()) {
      const bool is_served = std::any_of(robots_.begin(), robots_.end(), [&robot](const auto& arms) {
        return arms->name_space() == robot->name_space();
      });
      if (!is_served) robots_.push_back(std::make_unique<RobotArms>(core_, robot->name_space()));
    }
  }

  TwinCore& core_;
  std::vector<std::unique_ptr<RobotArms>> robots_;
};

}  // namespace

void add_arms(TwinCore& core) {
  core.add(std::make_unique<Arms>(core));
}

}  // namespace doppel
