#include "doppel/sensors/rigs/detail/world_scene.h"

#include <fmt/format.h>

#include "doppel/description/gazebo/label_plugin.h"
#include "doppel/sensors/render/scene_builder.h"
#include "doppel/sensors/rigs/detail/object_labels.h"

namespace doppel {
namespace {

constexpr double kGroundSize = 400;  // m

std::shared_ptr<const RenderScene> world_scene_by(SceneBuilder builder, const CompiledWorld& world,
                                                  Diagnostics& diagnostics) {
  const int ground = builder.add_body("ground");
  if (world.settings().ground) {
    SurfaceMaterial grey;
    grey.rgba = {0.62F, 0.63F, 0.64F, 1};
    grey.specular = 0;
    Pose below = Pose::Identity();
    below.translation().z() = -5e-4;  // what lies flat on the ground is seen
    builder.add_shape(ground, Plane{Eigen::Vector3d::UnitZ(), {kGroundSize, kGroundSize}}, below, grey);
  }
  for (const ModelInstance& instance : world.instances()) {
    builder.begin_model(instance.name);
    const VisualLabels labels(*instance.description, diagnostics);
    for (const ModelLink& link : instance.model->links) {
      const Link* described = instance.description->find_link(link.name);
      const std::string name = instance.name + "::" + link.name;
      if (described != nullptr)
        builder.add(*described, name, diagnostics, labels.of(*described));
      else
        builder.add_body(name);  // the "world" above a floating base
    }
  }
  const WorldSettings& settings = world.settings();
  for (const Light& light : settings.lights) builder.add_light(light);
  if (settings.environment) {
    builder.environment() = *settings.environment;
  } else {
    builder.environment().ambient = {0.62, 0.63, 0.66, 1};
    builder.environment().sky = Sky{};
  }
  auto scene = builder.finish();
  if (lacks_classes(*scene))
    diagnostics.warning(
        "sensor.labels", {},
        fmt::format("the world has {} visuals and no labels; in pictures of labels, those after "
                    "the first {} are 0, as the background",
                    scene->items.size(), ObjectLabels::kMostClasses),
        "label models or visuals by Gazebo's Label plugin");
  return scene;
}

}  // namespace

std::shared_ptr<const RenderScene> make_world_scene(const CompiledWorld& world, Diagnostics& diagnostics) {
  return world_scene_by(SceneBuilder(), world, diagnostics);
}

std::shared_ptr<const RenderScene> make_picture_scene(const CompiledWorld& world, Diagnostics& diagnostics) {
  SceneBuilder builder;
  builder.mark_missing_meshes();
  return world_scene_by(std::move(builder), world, diagnostics);
}

void read_poses(const Engine& engine, std::vector<Pose>& out) {
  out.clear();
  out.push_back(Pose::Identity());
  const auto& instances = engine.world().instances();
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const Instance instance = engine.instance(static_cast<int>(i));
    const auto links = static_cast<int>(instances[i].model->links.size());
    for (int link = 0; link < links; ++link) out.push_back(instance.link_pose(link));
  }
}

}  // namespace doppel
