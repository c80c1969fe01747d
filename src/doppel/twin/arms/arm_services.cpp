#include "doppel/twin/arms/arm_services.h"

#include <atomic>
#include <utility>

#include "doppel/base/core/thrown.h"
#include "doppel/ros/bus/standard_node.h"
#include "doppel/twin/arms/detail/arm_answers.h"
#include "doppel/twin/arms/detail/arm_worker.h"
#include "doppel/twin/arms/detail/scene_keeper.h"

namespace doppel {

struct ArmServices::Impl {
  Impl(Bus& the_bus, const Log& the_log, const std::string& name_space,
       std::function<std::optional<ArmSnapshot>()> the_snapshot)
      : bus(the_bus),
        log(the_log),
        snapshot(std::move(the_snapshot)),
        node(the_bus, (name_space.empty() ? "" : "/" + name_space) + "/move_group"),
        solving(the_log),
        mapping(the_log) {
    node.set_yielding();
    make_standard(node);
  }

  // A thread with what only it uses. A map takes seconds, and must not make poses wait.
  struct Lane {
    explicit Lane(const Log& log) : worker(log) {}
    KnownArms arms;
    std::atomic<unsigned> newest{0};  // the number of the last request
    ArmWorker worker;                 // last: its thread uses the members above until it is joined
  };

  // The loop copies the state, `answer` runs on the lane's thread, and the loop sends its result. With
  // `newest_only` a request ends the one before it.
  template <class S>
  void serve(const char* name, Lane& lane, ArmAnswer<S> answer, bool newest_only = false) {
    node.serve<S>(name, [this, &lane, answer, newest_only](const typename S::Request& request,
                                                           const Responder<typename S::Response>& respond) {
      std::optional<ArmSnapshot> now = snapshot();
      if (!now) return;
      auto shared = std::make_shared<ArmSnapshot>(std::move(*now));
      const unsigned number = ++lane.newest;
      const auto ends = [&lane, number, newest_only] {
        return lane.worker.stopping() || (newest_only && lane.newest != number);
      };
      const bool accepted = lane.worker.post([this, &lane, answer, request, respond, shared, ends] {
        shared->objects = scene.current();
        auto response = std::make_shared<typename S::Response>();
        const auto warn = [this](std::string why) { report({std::move(why)}); };
        try {
          answer({*shared, lane.arms, ends, warn}, request, *response);
        } catch (...) {
          refuse(*response, thrown_text());
        }
        bus.post([respond, response] { respond(*response); });
      });
      if (accepted) return;
      typename S::Response busy;
      refuse(busy, "too many requests are waiting; wait for an answer before the next one");
      respond(busy);
    });
  }

  // Messages change the scene on the thread that solves, so that a request after them finds it changed.
  template <class M>
  void listen(const char* topic) {
    node.subscribe<M>(topic, [this](const M& message) {
      std::optional<ArmSnapshot> now = snapshot();
      if (!now) return;
      auto shared = std::make_shared<ArmSnapshot>(std::move(*now));
      const bool accepted = solving.worker.post([this, shared, message] {
        shared->objects = scene.current();
        std::vector<std::string> refused = scene.apply(*shared, message);
        for (std::string& why : refused) why = "planning scene: " + why;
        report(std::move(refused));
      });
      if (!accepted) report({"planning scene: too many messages are waiting, so that this one is dropped"});
    });
  }

  void report(std::vector<std::string> refused) {
    if (refused.empty()) return;
    bus.post([&lines = log, refused] {  // without `this`: the loop may run it when the robot is gone
      for (const std::string& why : refused) lines.warning("move_group", why);
    });
  }

  Bus& bus;
  const Log& log;
  std::function<std::optional<ArmSnapshot>()> snapshot;
  Node node;
  SceneKeeper scene;
  Lane solving, mapping;  // last: their threads use the members above
};

ArmServices::ArmServices(Bus& bus, const Log& log, const std::string& name_space,
                         std::function<std::optional<ArmSnapshot>()> snapshot)
    : impl_(std::make_unique<Impl>(bus, log, name_space, std::move(snapshot))) {
  impl_->serve<moveit_msgs::srv::GetPositionIK>("compute_ik", impl_->solving, answer_position_ik);
  impl_->serve<moveit_msgs::srv::GetPositionFK>("compute_fk", impl_->solving, answer_position_fk);
  impl_->serve<moveit_msgs::srv::GetStateValidity>("check_state_validity", impl_->solving,
                                                   answer_state_validity);
  impl_->serve<doppel_msgs::srv::SolveIk>("doppel/ik", impl_->solving, answer_solve_ik);
  impl_->serve<doppel_msgs::srv::ListArms>("doppel/arms", impl_->solving, answer_list_arms);
  impl_->serve<doppel_msgs::srv::GetReach>("doppel/reach", impl_->mapping, answer_reach, true);
  impl_->listen<moveit_msgs::msg::CollisionObject>("collision_object");
  impl_->listen<moveit_msgs::msg::AttachedCollisionObject>("attached_collision_object");
  impl_->listen<moveit_msgs::msg::PlanningSceneWorld>("planning_scene_world");
}

ArmServices::~ArmServices() = default;

}  // namespace doppel
