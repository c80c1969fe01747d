#include "doppel/twin/loop/detail/load_publisher.h"

#include "doppel/scenario/schema/robot_names.h"

namespace doppel {

LoadPublisher::LoadPublisher(Bus& bus, std::shared_ptr<const CompiledRobot> machine)
    : machine_(std::move(machine)), node_(bus, in_namespace(machine_->name_space(), "doppel")) {
  topic_ = node_.advertise<doppel_msgs::msg::JointLoads>("~/joint_loads");
}

void LoadPublisher::publish(const Instance& robot, Time now) {
  const Model& model = machine_->model();
  if (!data_) {
    data_.emplace(model);
    message_.joint_names = model.driven_joint_names();
  }
  const Eigen::Map<const Eigen::VectorXd> q(robot.q().data(), model.nq);
  static_sag(model, *data_, machine_->servos(), q, machine_->gravity_R(), static_);
  for (auto* list : {&message_.efforts, &message_.gravity_torques, &message_.sags, &message_.margins,
                     &message_.effort_limits, &message_.frictions, &message_.least_sags, &message_.most_sags})
    list->clear();
  for (const Sag& sag : static_.sags) {
    const auto joint = static_cast<std::size_t>(sag.joint);
    message_.efforts.push_back(robot.drive_effort()[joint]);
    message_.gravity_torques.push_back(sag.torque);
    message_.sags.push_back(sag.sag);
    message_.margins.push_back(sag.margin);
    message_.effort_limits.push_back(machine_->servos()[joint].effort);
    message_.frictions.push_back(sag.friction);
    message_.least_sags.push_back(sag.least);
    message_.most_sags.push_back(sag.most);
  }
  message_.header.stamp = to_time_msg(node_.bus().stamp(now));
  topic_.publish(message_, now);
}

}  // namespace doppel
