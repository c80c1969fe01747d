#include "doppel/sensing/detail/object_labels.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace doppel {
namespace {

using vision_msgs::msg::Detection2D;

// Pixels, at their centres.
struct PixelBox {
  double left = std::numeric_limits<double>::infinity(), top = left, right = -left, bottom = -left;
  void add(double u, double v) {
    left = std::min(left, u);
    right = std::max(right, u);
    top = std::min(top, v);
    bottom = std::max(bottom, v);
  }
  [[nodiscard]] bool empty() const { return right < left; }
};

PixelBox clipped(PixelBox box, const CameraIntrinsics& camera) {
  box.left = std::max(box.left, 0.0);
  box.top = std::max(box.top, 0.0);
  box.right = std::min(box.right, camera.width - 1.0);
  box.bottom = std::min(box.bottom, camera.height - 1.0);
  return box;
}

void add_surface(const SurfaceMesh& mesh, const Pose& X_CM, const CameraIntrinsics& camera, PixelBox& box) {
  const double most = largest_radius(camera);
  for (const Eigen::Vector3f& p : mesh.positions) {
    const Eigen::Vector3d p_C = X_CM * p.cast<double>();
    if (p_C.head<2>().norm() > most * p_C.z()) continue;
    if (const auto pixel = project(camera, p_C)) box.add(pixel->x(), pixel->y());
  }
}

std::vector<PixelBox> visible_boxes(const ObjectLabels& objects, std::span<const std::uint32_t> labels,
                                    int width, std::size_t models) {
  std::vector<PixelBox> boxes(models);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const int object = objects.object_of(labels[i]);
    if (object < 0) continue;
    const auto columns = static_cast<std::size_t>(width), row = i / columns;
    boxes[static_cast<std::size_t>(object)].add(static_cast<double>(i - row * columns),
                                                static_cast<double>(row));
  }
  return boxes;
}

Detection2D detection(const PixelBox& box, std::string class_id, const std::string& name) {
  Detection2D out;
  out.results.resize(1);
  out.results[0].hypothesis = {std::move(class_id), 1};
  out.bbox.center.position = {(box.left + box.right) / 2, (box.top + box.bottom) / 2};
  out.bbox.size_x = box.right - box.left + 1;
  out.bbox.size_y = box.bottom - box.top + 1;
  out.id = name;
  return out;
}

}  // namespace

ObjectLabels::ObjectLabels(const RenderScene& scene) : scene_(scene) {
  labelled_ = std::any_of(scene.models.begin(), scene.models.end(),
                          [](const SceneModel& model) { return model.label.has_value(); });
  classes_.assign(scene.items.size() + 1, 0);
  objects_.assign(scene.items.size() + 1, -1);
  for (const SceneItem& item : scene.items) {
    const int model = scene.bodies[static_cast<std::size_t>(item.body)].model;
    if (!labelled_) {
      classes_[item.label] = static_cast<std::uint16_t>(item.label);
      objects_[item.label] = model;
    } else if (model >= 0 && scene.models[static_cast<std::size_t>(model)].label) {
      classes_[item.label] = *scene.models[static_cast<std::size_t>(model)].label;
      objects_[item.label] = model;
    }
  }
}

std::string ObjectLabels::class_id(int object) const {
  const SceneModel& model = scene_.models[static_cast<std::size_t>(object)];
  return model.label ? fmt::format("{}", *model.label) : model.name;
}

std::vector<Detection2D> boxes_of(const RenderScene& scene, std::span<const std::uint32_t> labels,
                                  const CameraIntrinsics& camera, bool full, std::span<const Pose> bodies,
                                  const Pose& X_WC) {
  const ObjectLabels objects(scene);
  std::vector<PixelBox> boxes = visible_boxes(objects, labels, camera.width, scene.models.size());
  if (full) {
    const Pose X_CW = X_WC.inverse();
    for (const SceneItem& item : scene.items) {
      const int object = objects.object_of(item.label);
      if (object < 0 || boxes[static_cast<std::size_t>(object)].empty()) continue;
      add_surface(*scene.meshes[static_cast<std::size_t>(item.mesh)],
                  X_CW * bodies[static_cast<std::size_t>(item.body)] * item.X_BM, camera,
                  boxes[static_cast<std::size_t>(object)]);
    }
  }
  std::vector<Detection2D> out;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    if (!boxes[i].empty())
      out.push_back(
          detection(clipped(boxes[i], camera), objects.class_id(static_cast<int>(i)), scene.models[i].name));
  return out;
}

}  // namespace doppel
