#include "doppel/twin/publishers/detail/contact_publisher.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/sensors/rigs/pose_messages.h"

namespace doppel {

ContactPublisher::ContactPublisher(Bus& bus, const Scene& scene) : scene_(scene), node_(bus, "/gazebo") {
  topic_ = node_.advertise<gazebo_msgs::msg::ContactsState>("~/contacts");
}

std::string ContactPublisher::shape_name(BodyId body) const {
  const Instance instance = scene_.instance(body.instance);
  const std::string& name = instance.model().links[static_cast<std::size_t>(body.link)].name;
  if (!scene_.is_robot(body.instance)) {
    const bool one_link = instance.model().links.size() == (instance.made_of().floating() ? 2u : 1u);
    return fmt::format("{}::{}::collision", instance.name(), one_link ? "link" : name);
  }
  return fmt::format("{}::{}::{}_collision", instance.name(), name, name);
}

void ContactPublisher::name_shapes() {
  if (named_ == scene_.engine().compiled()) return;
  named_ = scene_.engine().compiled();
  names_.clear();
  for (int i = 0; i < static_cast<int>(named_->instances().size()); ++i) {
    auto& of_links = names_.emplace_back();
    const auto links = named_->instances()[static_cast<std::size_t>(i)].model->links.size();
    for (int link = 0; link < static_cast<int>(links); ++link) of_links.push_back(shape_name({i, link}));
  }
}

const std::string& ContactPublisher::name_of(BodyId body) const {
  if (body.is_ground()) return ground_;
  return names_[static_cast<std::size_t>(body.instance)][static_cast<std::size_t>(body.link)];
}

gazebo_msgs::msg::ContactState& ContactPublisher::state_of(BodyId a, BodyId b) {
  const std::string &first = name_of(a), &second = name_of(b);
  const auto found = std::ranges::find_if(message_.states, [&](const auto& s) {
    return s.collision1_name == first && s.collision2_name == second;
  });
  if (found != message_.states.end()) return *found;
  if (spare_.empty()) spare_.emplace_back();
  auto& out = message_.states.emplace_back(std::move(spare_.back()));
  spare_.pop_back();
  out.info.assign(first).append(" touches ").append(second);
  out.collision1_name = first;
  out.collision2_name = second;
  out.total_wrench = {};
  out.wrenches.clear();
  out.contact_positions.clear();
  out.contact_normals.clear();
  out.depths.clear();
  return out;
}

void ContactPublisher::publish_contacts(Time now) {
  scene_.engine().contacts(contacts_);
  name_shapes();
  const Pose X_TW = scene_.world_in_tf();
  message_.header.stamp = to_time_msg(node_.bus().stamp(now));
  message_.header.frame_id = "world";
  for (auto& state : message_.states) spare_.push_back(std::move(state));
  message_.states.clear();
  for (const Contact& contact : contacts_) {
    gazebo_msgs::msg::ContactState& state = state_of(contact.a, contact.b);
    // Gazebo's wrench acts on the first shape, the engine's on the second.
    const Eigen::Vector3d force = X_TW.linear() * -contact.force_W;
    const Eigen::Vector3d torque = X_TW.linear() * -contact.torque_W;
    state.wrenches.push_back({to_vector_msg(force), to_vector_msg(torque)});
    state.total_wrench.force.x += force.x();
    state.total_wrench.force.y += force.y();
    state.total_wrench.force.z += force.z();
    state.total_wrench.torque.x += torque.x();
    state.total_wrench.torque.y += torque.y();
    state.total_wrench.torque.z += torque.z();
    state.contact_positions.push_back(to_vector_msg(X_TW * contact.p_W));
    state.contact_normals.push_back(to_vector_msg(X_TW.linear() * -contact.normal_W));
    state.depths.push_back(contact.depth);
  }
  topic_.publish(message_, now);
}

}  // namespace doppel
