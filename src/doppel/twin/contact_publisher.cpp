#include "doppel/twin/detail/contact_publisher.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/twin/pose_messages.h"

namespace doppel {

ContactPublisher::ContactPublisher(Bus& bus, const Scene& scene) : scene_(scene), node_(bus, "/gazebo") {
  topic_ = node_.advertise<gazebo_msgs::msg::ContactsState>("~/contacts");
}

std::string ContactPublisher::shape_name(BodyId body) const {
  if (body.is_ground()) return "ground::link::collision";
  const Instance instance = scene_.instance(body.instance);
  const std::string& name = instance.model().links[static_cast<std::size_t>(body.link)].name;
  if (!scene_.is_robot(body.instance)) {
    const bool one_link = instance.model().links.size() == (instance.made_of().floating() ? 2u : 1u);
    return fmt::format("{}::{}::collision", instance.name(), one_link ? "link" : name);
  }
  return fmt::format("{}::{}::{}_collision", instance.name(), name, name);
}

void ContactPublisher::publish_contacts(Time now) {
  scene_.engine().contacts(contacts_);
  const Pose X_TW = scene_.world_in_tf();
  gazebo_msgs::msg::ContactsState message;
  message.header.stamp = to_time_msg(node_.bus().stamp(now));
  message.header.frame_id = "world";
  for (const Contact& contact : contacts_) {
    const std::string first = shape_name(contact.a);
    const std::string second = shape_name(contact.b);
    auto state = std::ranges::find_if(message.states, [&](const auto& s) {
      return s.collision1_name == first && s.collision2_name == second;
    });
    if (state == message.states.end()) {
      state = message.states.emplace(message.states.end());
      state->info = fmt::format("{} touches {}", first, second);
      state->collision1_name = first;
      state->collision2_name = second;
    }
    // Gazebo's wrench acts on the first shape, the engine's force on the second.
    const Eigen::Vector3d force = X_TW.linear() * -contact.force_W;
    state->wrenches.push_back({to_vector_msg(force), {}});
    state->total_wrench.force.x += force.x();
    state->total_wrench.force.y += force.y();
    state->total_wrench.force.z += force.z();
    state->contact_positions.push_back(to_vector_msg(X_TW * contact.p_W));
    state->contact_normals.push_back(to_vector_msg(X_TW.linear() * -contact.normal_W));
    state->depths.push_back(contact.depth);
  }
  topic_.publish(message, now);
}

}  // namespace doppel
