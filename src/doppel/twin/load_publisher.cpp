#include "doppel/twin/load_publisher.h"

namespace doppel {

LoadPublisher::LoadPublisher(Bus& bus, const Model& model, const std::vector<ServoParameters>& servos,
                             const Eigen::Vector3d& gravity_R)
    : model_(model), servos_(servos), gravity_R_(gravity_R), node_(bus, "/doppel") {
  topic_ = node_.advertise<doppel_msgs::msg::JointLoads>("~/joint_loads");
}

void LoadPublisher::publish(const Engine& engine, Time now) {
  if (!data_) {
    data_.emplace(model_);
    message_.joint_names = model_.driven_joint_names();
  }
  const auto q = engine.q();
  static_sag(model_, *data_, servos_, Eigen::Map<const Eigen::VectorXd>(q.data(), model_.nq), gravity_R_,
             static_);
  for (auto* list : {&message_.efforts, &message_.gravity_torques, &message_.sags, &message_.margins,
                     &message_.effort_limits, &message_.frictions, &message_.least_sags, &message_.most_sags})
    list->clear();
  for (const Sag& sag : static_.sags) {
    const auto joint = static_cast<std::size_t>(sag.joint);
    message_.efforts.push_back(engine.drive_effort()[joint]);
    message_.gravity_torques.push_back(sag.torque);
    message_.sags.push_back(sag.sag);
    message_.margins.push_back(sag.margin);
    message_.effort_limits.push_back(servos_[joint].effort);
    message_.frictions.push_back(sag.friction);
    message_.least_sags.push_back(sag.least);
    message_.most_sags.push_back(sag.most);
  }
  message_.header.stamp = to_time_msg(node_.bus().stamp(now));
  topic_.publish(message_, now);
}

}  // namespace doppel
