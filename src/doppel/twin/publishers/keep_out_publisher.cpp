#include "doppel/twin/publishers/detail/keep_out_publisher.h"

#include "doppel/sensors/rigs/pose_messages.h"
#include "doppel/twin/loop/twin_core.h"

namespace doppel {
namespace {

using visualization_msgs::msg::Marker;

constexpr double kNameHeight = 0.05;  // m, of the letters

Marker cube_of(const KeepOutBox& box, const Pose& X_TW, std::int32_t id) {
  Marker out;
  out.header.frame_id = "world";
  out.ns = "keep_out";
  out.id = id;
  out.type = Marker::CUBE;
  out.text = box.name;
  out.pose = to_pose_msg(X_TW * box.X_WB);
  out.scale = to_vector_msg(box.size);
  out.color = {0.84F, 0.37F, 0.0F, 0.25F};
  return out;
}

Marker name_of(const KeepOutBox& box, const Pose& X_TW, std::int32_t id) {
  Marker out;
  out.header.frame_id = "world";
  out.ns = "keep_out_names";
  out.id = id;
  out.type = Marker::TEXT_VIEW_FACING;
  out.text = box.name;
  const double top = box.X_WB.linear().row(2).cwiseAbs().dot(box.size) / 2 + kNameHeight;
  out.pose = to_pose_msg(X_TW * Eigen::Translation3d(0, 0, top) *
                         Pose(Eigen::Translation3d(box.X_WB.translation())));
  out.scale.z = kNameHeight;
  out.color = {0.84F, 0.37F, 0.0F, 1.0F};
  return out;
}

}  // namespace

KeepOutPublisher::KeepOutPublisher(TwinCore& core)
    : core_(core),
      node_(core.bus(), "/doppel"),
      topic_(node_.advertise<visualization_msgs::msg::MarkerArray>("~/keep_out",
                                                                   {.depth = 1, .latched = true})) {}

void KeepOutPublisher::publish_boxes(Time now) {
  published_ = true;
  visualization_msgs::msg::MarkerArray message;
  message.markers.emplace_back().action = Marker::DELETEALL;
  message.markers.front().header.frame_id = "world";
  const Pose X_TW = core_.scene().world_in_tf();
  std::int32_t id = 0;
  for (const KeepOutBox& box : core_.machine().keep_out) {
    message.markers.push_back(cube_of(box, X_TW, id));
    message.markers.push_back(name_of(box, X_TW, id++));
  }
  for (Marker& marker : message.markers) marker.header.stamp = to_time_msg(node_.bus().stamp(now));
  topic_.publish(message, now);
}

}  // namespace doppel
