#include "doppel/twin/arms/arm_services.h"

#include <atomic>
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
        solving(log),
        mapping(log) {
    make_standard(node);
  }

  // A thread with what only it uses. A map takes seconds, and must not make poses wait.
  struct Lane {
    explicit Lane(const Log& log) : worker(log) {}
    ArmWorker worker;
    KnownArms arms;
    std::atomic<unsigned> newest{0};  // the number of the last request
  };

  // The loop takes a snapshot, `answer` runs on the lane's thread, and the loop sends its result. With
  // `newest_only` a request ends the one before it.
  template <class S>
  void serve(const char* name, Lane& lane, ArmAnswer<S> answer, bool newest_only = false) {
    node.serve<S>(name, [this, &lane, answer, newest_only](const typename S::Request& request,
                                                           const Responder<typename S::Response>& respond) {
      std::optional<ArmSnapshot> now = snapshot();
      if (!now) return;
      auto shared = std::make_shared<const ArmSnapshot>(std::move(*now));
      const unsigned number = ++lane.newest;
      const auto ends = [&lane, number, newest_only] {
        return lane.worker.stopping() || (newest_only && lane.newest != number);
      };
      const bool accepted = lane.worker.post([this, &lane, answer, request, respond, shared, ends] {
        auto response = std::make_shared<typename S::Response>();
        answer({*shared, lane.arms, ends}, request, *response);
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
  impl_->serve<doppel_msgs::srv::GetReach>("doppel/reach", impl_->mapping, answer_reach, true);
}

ArmServices::~ArmServices() = default;

}  // namespace doppel
