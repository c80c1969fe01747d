#include "doppel/robot/scene_objects/scene_objects.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"

namespace doppel {
namespace {

[[noreturn]] void refuse(const char* rule, const std::string& message, const std::string& fix = "") {
  throw InputError(rule, {}, message, fix);
}

// Subframes of `added` replace those of the same names.
void merge_subframes(std::vector<Subframe>& frames, const std::vector<Subframe>& added) {
  for (const Subframe& frame : added) {
    const auto found = std::ranges::find(frames, frame.name, &Subframe::name);
    if (found == frames.end()) {
      frames.push_back(frame);
    } else {
      *found = frame;
    }
  }
}

void merge_names(std::vector<std::string>& names, const std::vector<std::string>& added) {
  for (const std::string& name : added) {
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
}

// The shapes and subframes of `added`, which has the same parent, in the frame of `object`.
void extend(SceneObject& object, const SceneObject& added) {
  const Pose X_OA = object.X_PO.inverse(Eigen::Isometry) * added.X_PO;
  for (ObjectShape shape : added.shapes) {
    shape.X_OS = X_OA * shape.X_OS;
    object.shapes.push_back(std::move(shape));
  }
  std::vector<Subframe> frames = added.subframes;
  for (Subframe& frame : frames) frame.X_OF = X_OA * frame.X_OF;
  merge_subframes(object.subframes, frames);
  merge_names(object.touch_links, added.touch_links);
  if (added.rgba) object.rgba = added.rgba;
}

}  // namespace

SceneObject& SceneObjects::existing(const std::string& id, bool in_world) {
  const auto found = objects_.find(id);
  if (found == objects_.end()) {
    std::vector<std::string> names;
    for (const auto& [name, object] : objects_) names.push_back(name);
    refuse("scene.unknown_object",
           fmt::format("the scene has no object '{}'{}", id, did_you_mean(id, names)));
  }
  if (in_world && !found->second.link.empty()) {
    refuse(
        "scene.attached",
        fmt::format("object '{}' is attached to link '{}', so that it moves with it", id, found->second.link),
        "detach it first");
  }
  return found->second;
}

void SceneObjects::put(SceneObject object) {
  if (objects_.size() >= kMaxSceneObjects && !objects_.contains(object.id)) {
    refuse("scene.count", fmt::format("the scene has {} objects, which is the most", kMaxSceneObjects),
           "give one object several shapes");
  }
  std::string id = object.id;
  objects_.insert_or_assign(std::move(id), std::move(object));
}

void SceneObjects::add(SceneObject object) {
  check_object(object);
  if (object.id == kOctomapId) refuse("scene.object", "the name '<octomap>' is that of the octomap");
  if (objects_.contains(object.id)) (void)existing(object.id, true);
  put(std::move(object));
}

void SceneObjects::append(SceneObject object) {
  check_object(object);
  if (!objects_.contains(object.id)) return add(std::move(object));
  extend(existing(object.id, true), object);
}

void SceneObjects::move(const std::string& id, const Pose& X_WO, const std::vector<Pose>& shape_poses) {
  SceneObject moved = existing(id, true);
  if (!shape_poses.empty() && shape_poses.size() != moved.shapes.size()) {
    refuse("scene.object", fmt::format("object '{}' has {} shapes, and {} poses for them", id,
                                       moved.shapes.size(), shape_poses.size()));
  }
  moved.X_PO = X_WO;
  for (std::size_t i = 0; i < shape_poses.size(); ++i) moved.shapes[i].X_OS = shape_poses[i];
  check_object(moved);
  put(std::move(moved));
}

void SceneObjects::remove(const std::string& id) {
  if (id.empty()) {
    std::erase_if(objects_, [](const auto& entry) { return entry.second.link.empty(); });
    return;
  }
  (void)existing(id, true);
  objects_.erase(id);
}

void SceneObjects::set_octomap(SharedCells cells, const Pose& X_WO) {
  objects_.erase(kOctomapId);
  if (cells == nullptr || cells->empty()) return;
  SceneObject map;
  map.id = kOctomapId;
  map.X_PO = X_WO;
  map.shapes.push_back({std::move(cells)});
  check_object(map);
  put(std::move(map));
}

void SceneObjects::attach(SceneObject object, const LinkPose& X_WL, bool append) {
  if (object.id == kOctomapId) refuse("scene.object", "the octomap cannot be attached");
  if (object.link.empty()) refuse("scene.attached", "the link that holds the object is not named");
  if (object.shapes.empty()) {
    SceneObject held = existing(object.id, true);
    held.X_PO = X_WL(object.link).inverse(Eigen::Isometry) * held.X_PO;
    held.link = object.link;
    merge_names(held.touch_links, object.touch_links);
    merge_subframes(held.subframes, object.subframes);
    return put(std::move(held));
  }
  check_object(object);
  const SceneObject* const before = find(object.id);
  if (append && before != nullptr && before->link == object.link) {
    extend(existing(object.id, false), object);
    return;
  }
  put(std::move(object));
}

void SceneObjects::detach(const std::string& id, const std::string& link, const LinkPose& X_WL) {
  const auto put_down = [&X_WL](SceneObject& object) {
    object.X_PO = X_WL(object.link) * object.X_PO;
    object.link.clear();
    object.touch_links.clear();
  };
  if (id.empty()) {
    for (auto& [name, object] : objects_) {
      if (!object.link.empty() && (link.empty() || object.link == link)) put_down(object);
    }
    return;
  }
  if (id == kOctomapId) refuse("scene.object", "the octomap cannot be attached");
  SceneObject& object = existing(id, false);
  if (object.link.empty() || (!link.empty() && object.link != link)) {
    refuse("scene.attached",
           object.link.empty()
               ? fmt::format("object '{}' is not attached", id)
               : fmt::format("object '{}' is attached to link '{}', not to '{}'", id, object.link, link));
  }
  put_down(object);
}

const SceneObject* SceneObjects::find(const std::string& id) const {
  const auto found = objects_.find(id);
  return found == objects_.end() ? nullptr : &found->second;
}

std::optional<ObjectFrame> SceneObjects::frame(const std::string& name) const {
  if (const SceneObject* const object = find(name)) return ObjectFrame{object->link, object->X_PO};
  // Names of objects and of subframes may have slashes themselves.
  for (std::size_t slash = name.find('/'); slash != std::string::npos; slash = name.find('/', slash + 1)) {
    const SceneObject* const object = find(name.substr(0, slash));
    if (object == nullptr) continue;
    const auto found = std::ranges::find(object->subframes, name.substr(slash + 1), &Subframe::name);
    if (found != object->subframes.end()) return ObjectFrame{object->link, object->X_PO * found->X_OF};
  }
  return std::nullopt;
}

std::vector<std::string> SceneObjects::frame_names() const {
  std::vector<std::string> out;
  for (const auto& [id, object] : objects_) {
    out.push_back(id);
    for (const Subframe& frame : object.subframes) out.push_back(id + "/" + frame.name);
  }
  return out;
}

}  // namespace doppel
