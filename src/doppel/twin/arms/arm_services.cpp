#include "doppel/twin/arms/arm_services.h"

#include <utility>

#include "doppel/ros/bus/standard_node.h"
#include "doppel/twin/arms/detail/arm_answers.h"
#include "doppel/twin/arms/detail/arm_worker.h"

namespace doppel {

struct ArmServices::Impl {
  Impl(Bus& the_bus, const Log& log, const std::string& name_space,
       std::function<std::optional<ArmSnapshot>()> the_snapshot)
      : bus(the_bus),
        snapshot(std::move(the_snapshot)),
        node(the_bus, (name_space.empty() ? "" : "/" + name_space) + "/move_group"),
        solving{ArmWorker(log), {}},
        mapping{ArmWorker(log), {}} {
    make_standard(node);
  }

  // A thread with what only it uses. A map takes seconds, and must not make poses wait.
  struct Lane {
    ArmWorker worker;
    KnownArms arms;
  };

  // The loop takes a snapshot, `answer` runs on the lane's thread, and the loop hands its result out.
  template <class S>
  void serve(const char* name, Lane& lane, ArmAnswer<S> answer) {
    node.serve<S>(name, [this, &lane, answer](const typename S::Request& request,
                                              const Responder<typename S::Response>& respond) {
      std::optional<ArmSnapshot> now = snapshot();
      if (!now) return;
      auto shared = std::make_shared<const ArmSnapshot>(std::move(*now));
      const bool accepted = lane.worker.post([this, &lane, answer, request, respond, shared] {
        auto response = std::make_shared<typename S::Response>();
        answer({*shared, lane.arms, [&lane] { return lane.worker.stopping(); }}, request, *response);
        bus.post([respond, response] { respond(*response); });
      });
      if (accepted) return;
      typename S::Response busy;
      refuse(busy, "too many requests are waiting; wait for an answer before the next one");
      respond(busy);
    });
  }

  Bus& bus;
  std::function<std::optional<ArmSnapshot>()> snapshot;
  Node node;
  Lane solving, mapping;  // destroyed first: their threads use what is above
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
  impl_->serve<doppel_msgs::srv::GetReach>("doppel/reach", impl_->mapping, answer_reach);
}

ArmServices::~ArmServices() = default;

}  // namespace doppel
