#include "doppel/sensing/detail/object_labels.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

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
                                    int width) {
  std::vector<PixelBox> boxes(objects.objects());
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

bool has_labels(const RenderScene& scene) {
  return std::any_of(scene.items.begin(), scene.items.end(),
                     [](const SceneItem& item) { return item.class_label.has_value(); });
}

}  // namespace

bool lacks_classes(const RenderScene& scene) {
  return scene.items.size() > ObjectLabels::kMostClasses && !has_labels(scene);
}

ObjectLabels::ObjectLabels(std::shared_ptr<const RenderScene> scene) : scene_(std::move(scene)) {
  const bool labelled = has_labels(*scene_);
  classes_.assign(scene_->items.size() + 1, 0);
  object_of_.assign(scene_->items.size() + 1, -1);
  std::map<std::pair<int, std::optional<std::uint16_t>>, int> found;
  for (const SceneItem& item : scene_->items) {
    const int model = scene_->bodies[static_cast<std::size_t>(item.body)].model;
    if (labelled && !item.class_label) continue;
    if (labelled)
      classes_[item.label] = *item.class_label;
    else if (item.label <= kMostClasses)
      classes_[item.label] = static_cast<std::uint16_t>(item.label);
    if (model < 0) continue;
    const auto [at, fresh] = found.try_emplace({model, item.class_label}, static_cast<int>(objects_.size()));
    if (fresh) objects_.push_back({model, item.class_label});
    object_of_[item.label] = at->second;
  }
}

std::string ObjectLabels::class_id(std::size_t object) const {
  const Object& of = objects_[object];
  return of.label ? fmt::format("{}", *of.label) : scene_->models[static_cast<std::size_t>(of.model)].name;
}

std::string ObjectLabels::name(std::size_t object) const {
  const Object& of = objects_[object];
  const std::string& name = scene_->models[static_cast<std::size_t>(of.model)].name;
  const auto parts = std::count_if(objects_.begin(), objects_.end(),
                                   [&of](const Object& other) { return other.model == of.model; });
  return parts > 1 ? fmt::format("{}/{}", name, *of.label) : name;
}

std::vector<Detection2D> boxes_of(const ObjectLabels& objects, std::span<const std::uint32_t> labels,
                                  const CameraIntrinsics& camera, bool full, std::span<const Pose> bodies,
                                  const Pose& X_WC) {
  std::vector<PixelBox> boxes = visible_boxes(objects, labels, camera.width);
  if (full) {
    const Pose X_CW = X_WC.inverse();
    for (const SceneItem& item : objects.scene().items) {
      const int object = objects.object_of(item.label);
      if (object < 0 || boxes[static_cast<std::size_t>(object)].empty()) continue;
      add_surface(*objects.scene().meshes[static_cast<std::size_t>(item.mesh)],
                  X_CW * bodies[static_cast<std::size_t>(item.body)] * item.X_BM, camera,
                  boxes[static_cast<std::size_t>(object)]);
    }
  }
  std::vector<Detection2D> out;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    if (!boxes[i].empty())
      out.push_back(detection(clipped(boxes[i], camera), objects.class_id(i), objects.name(i)));
  return out;
}

}  // namespace doppel
