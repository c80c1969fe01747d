#include "doppel/sensors/rigs/detail/object_labels.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "doppel/sensors/rigs/pose_messages.h"

namespace doppel {
namespace {

using vision_msgs::msg::Detection2D;
using vision_msgs::msg::Detection3D;

constexpr std::uint32_t kMostInstances = 65535;  // of a class, of 16 bits

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

// Of an object that is certain; without its box.
template <class Detection>
Detection detection(const ObjectLabels& objects, std::size_t object) {
  Detection out;
  out.results.resize(1);
  out.results[0].hypothesis = {objects.class_id(object), 1};
  out.id = objects.name(object);
  return out;
}

Detection2D detection(const ObjectLabels& objects, std::size_t object, const PixelBox& box) {
  auto out = detection<Detection2D>(objects, object);
  out.bbox.center.position = {(box.left + box.right) / 2, (box.top + box.bottom) / 2};
  out.bbox.size_x = box.right - box.left + 1;
  out.bbox.size_y = box.bottom - box.top + 1;
  return out;
}

// X_FA: the axes of the box in the frame of the message.
Detection3D detection(const ObjectLabels& objects, std::size_t object, const Eigen::AlignedBox3d& box_A,
                      const Pose& X_FA) {
  auto out = detection<Detection3D>(objects, object);
  out.bbox.center = to_pose_msg(X_FA * Eigen::Translation3d(box_A.center()));
  out.bbox.size = to_vector_msg(box_A.sizes());
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
    if (fresh)
      objects_.push_back({model, item.class_label, 0, {item.body, item.X_BM}});
    else
      objects_[static_cast<std::size_t>(at->second)].axes.X_BA = Pose::Identity();
    object_of_[item.label] = at->second;
  }
  std::map<std::uint16_t, std::uint32_t> instances;
  for (Object& object : objects_) {
    const std::uint16_t of_class = object.label.value_or(1);
    const std::uint32_t number = ++instances[of_class];
    if (number <= kMostInstances) object.panoptic = std::uint32_t{of_class} << 16 | number;
  }
}

std::uint32_t ObjectLabels::panoptic_of(std::uint32_t label) const {
  const int object = object_of_[label];
  return object < 0 ? 0 : objects_[static_cast<std::size_t>(object)].panoptic;
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
    if (!boxes[i].empty()) out.push_back(detection(objects, i, clipped(boxes[i], camera)));
  return out;
}

std::vector<Detection3D> oriented_boxes_of(const ObjectLabels& objects, std::span<const std::uint32_t> labels,
                                           std::span<const Pose> bodies, const Pose& X_FW) {
  std::vector<char> visible(objects.objects(), 0);
  for (const std::uint32_t label : labels)
    if (const int object = objects.object_of(label); object >= 0)
      visible[static_cast<std::size_t>(object)] = 1;
  std::vector<Eigen::AlignedBox3d> boxes(visible.size());
  const auto X_WA = [&](std::size_t object) {
    const ObjectLabels::Axes& axes = objects.axes(object);
    return bodies[static_cast<std::size_t>(axes.body)] * axes.X_BA;
  };
  for (const SceneItem& item : objects.scene().items) {
    const int object = objects.object_of(item.label);
    if (object < 0 || visible[static_cast<std::size_t>(object)] == 0) continue;
    const Pose X_AM = X_WA(static_cast<std::size_t>(object)).inverse() *
                      bodies[static_cast<std::size_t>(item.body)] * item.X_BM;
    for (const Eigen::Vector3f& p : objects.scene().meshes[static_cast<std::size_t>(item.mesh)]->positions)
      boxes[static_cast<std::size_t>(object)].extend(X_AM * p.cast<double>());
  }
  std::vector<Detection3D> out;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    if (!boxes[i].isEmpty()) out.push_back(detection(objects, i, boxes[i], X_FW * X_WA(i)));
  return out;
}

}  // namespace doppel
