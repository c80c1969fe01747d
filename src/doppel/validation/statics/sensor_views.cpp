#include "doppel/validation/statics/detail/sensor_views.h"

#include <algorithm>
#include <functional>

#include "doppel/sensors/models/coverage.h"
#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
namespace {

int housing_of(const Model& model, const RenderScene& scene, int link) {
  while (link >= 0 && std::ranges::find(scene.items, link, &SceneItem::body) == scene.items.end()) {
    const int joint = model.links[static_cast<std::size_t>(link)].joint;
    if (joint < 0 || model.joints[static_cast<std::size_t>(joint)].type != JointType::fixed) return -1;
    link = model.joints[static_cast<std::size_t>(joint)].parent_link;
  }
  return link;
}

std::unique_ptr<RayCaster> caster_of(const RenderScene& scene, const std::function<bool(int body)>& is_part) {
  auto part = std::make_shared<RenderScene>(scene);
  std::erase_if(part->items, [&](const SceneItem& item) { return !is_part(item.body); });
  return make_ray_caster(std::move(part));
}

}  // namespace

std::shared_ptr<const RenderScene> robot_scene(const RobotDescription& robot, const Model& model,
                                               Diagnostics& warnings) {
  SceneBuilder builder;
  builder.begin_model(model.name);
  for (const ModelLink& link : model.links) {
    const Link* const described = robot.find_link(link.name);
    if (described != nullptr)
      builder.add(*described, link.name, warnings);
    else
      builder.add_body(link.name);
  }
  return builder.finish();
}

SensorViews::SensorViews(const Model& model, std::shared_ptr<const RenderScene> scene,
                         std::span<const SensorField> fields)
    : model_(model), fields_(fields), data_(model) {
  for (const SensorField& field : fields) {
    const int housing = housings_.emplace_back(housing_of(model, *scene, field.link));
    if (parts_.contains(housing)) continue;
    Parts& parts = parts_[housing];
    parts.others = caster_of(*scene, [housing](int body) { return body != housing; });
    if (housing >= 0) parts.housing = caster_of(*scene, [housing](int body) { return body == housing; });
  }
}

std::vector<std::vector<SeenPlace>> SensorViews::look(const Eigen::VectorXd& q,
                                                      std::span<const Eigen::Vector3d> places,
                                                      double radius) {
  forward_kinematics(model_, data_, q);
  for (auto& [housing, parts] : parts_) {
    parts.others->set_poses(data_.X_WL);
    if (parts.housing) parts.housing->set_poses(data_.X_WL);
  }
  std::vector<std::vector<SeenPlace>> out(fields_.size());
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const SensorField& field = fields_[i];
    const Pose X_SW = (link_pose(field.link) * field.X_LS).inverse();
    for (const Eigen::Vector3d& place : places) out[i].push_back({field.sight(X_SW * place, radius)});
    hide(field, parts_.at(housings_[i]), places, out[i]);
  }
  return out;
}

void SensorViews::hide(const SensorField& field, const Parts& parts, std::span<const Eigen::Vector3d> places,
                       std::vector<SeenPlace>& out) const {
  const Pose X_WS = link_pose(field.link) * field.X_LS;
  const Eigen::Vector3d eye = X_WS.translation();
  const std::vector<SightLine> lines = sight_lines(*parts.others, eye, places);
  const auto mark = [&](std::size_t i, const RayCaster& caster, const SightLine& line) {
    if (out[i].sight != PlaceSight::seen || line.is_free) return;
    const int body = caster.scene().items[static_cast<std::size_t>(line.item)].body;
    out[i] = {PlaceSight::hidden, body, line.distance};
  };
  for (std::size_t i = 0; i < places.size(); ++i) mark(i, *parts.others, lines[i]);
  if (!parts.housing) return;
  // The lens looks out of its housing: lines begin where the sensor begins to see.
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3d way = places[i] - eye;
    const double forward = way.normalized().dot(X_WS.linear().col(0));
    const bool is_camera = std::holds_alternative<CameraIntrinsics>(field.what);
    const double begin = is_camera && forward > 0 ? field.near / forward : field.near;
    if (out[i].sight != PlaceSight::seen || begin >= way.norm()) continue;
    SightLine line = sight_lines(*parts.housing, eye + begin * way.normalized(), {&places[i], 1}).front();
    line.distance += static_cast<float>(begin);
    mark(i, *parts.housing, line);
  }
}

}  // namespace doppel
