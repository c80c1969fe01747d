#include "doppel/validation/statics/detail/sensor_views.h"

#include <algorithm>
#include <functional>

#include "doppel/physics/contract/engine.h"
#include "doppel/sensors/models/coverage.h"
#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
namespace {

// m; kGroundDepth: so that a place that lies flat on the ground is seen.
constexpr double kGroundSize = 400, kGroundDepth = 5e-4;

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

SensorScene sensor_scene(const Subject& subject, Diagnostics& warnings) {
  SensorScene out;
  SceneBuilder builder;
  builder.begin_model(subject.model->name);
  const auto add = [&](const Link* described, const std::string& name) {
    if (described != nullptr)
      builder.add(*described, name, warnings);
    else
      builder.add_body(name);
  };
  for (const ModelLink& link : subject.model->links) {
    add(subject.description().find_link(link.name), link.name);
    out.names.push_back("link '" + link.name + "'");
  }
  const Engine& engine = *subject.compiled->engine;
  const CompiledWorld& world = engine.world();
  const Pose X_RW = subject.robot().instance().X_WR.inverse();
  if (world.settings().ground) {
    const int ground = builder.add_body("ground");
    builder.add_shape(ground, Plane{Eigen::Vector3d::UnitZ(), {kGroundSize, kGroundSize}}, Pose::Identity(),
                      {});
    out.names.emplace_back("the ground");
    Pose X_WB = Pose::Identity();
    X_WB.translation().z() = -kGroundDepth;
    out.X_RB.push_back(X_RW * X_WB);
  }
  for (std::size_t i = 0; i < world.instances().size(); ++i) {
    const ModelInstance& instance = world.instances()[i];
    if (instance.name == subject.robot().name()) continue;
    builder.begin_model(instance.name);
    for (std::size_t link = 0; link < instance.model->links.size(); ++link) {
      const std::string& name = instance.model->links[link].name;
      add(instance.description->find_link(name), instance.name + "::" + name);
      out.names.push_back("object '" + instance.name + "'");
      out.X_RB.push_back(X_RW * engine.instance(static_cast<int>(i)).link_pose(static_cast<int>(link)));
    }
  }
  out.scene = builder.finish();
  return out;
}

SensorViews::SensorViews(const Model& model, const SensorScene& scene, std::span<const SensorField> fields)
    : model_(model), X_RB_(model.links.size(), Pose::Identity()), fields_(fields), data_(model) {
  X_RB_.insert(X_RB_.end(), scene.X_RB.begin(), scene.X_RB.end());
  for (const SensorField& field : fields) {
    const int housing = housings_.emplace_back(housing_of(model, *scene.scene, field.link));
    if (parts_.contains(housing)) continue;
    Parts& parts = parts_[housing];
    parts.others = caster_of(*scene.scene, [housing](int body) { return body != housing; });
    if (housing >= 0)
      parts.housing = caster_of(*scene.scene, [housing](int body) { return body == housing; });
  }
}

std::vector<std::vector<SeenPlace>> SensorViews::look(const Eigen::VectorXd& q,
                                                      std::span<const Eigen::Vector3d> places,
                                                      double radius) {
  forward_kinematics(model_, data_, q);
  std::ranges::copy(data_.X_WL, X_RB_.begin());
  for (auto& [housing, parts] : parts_) {
    parts.others->set_poses(X_RB_);
    if (parts.housing) parts.housing->set_poses(X_RB_);
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
