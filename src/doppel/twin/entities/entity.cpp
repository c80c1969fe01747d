#include "doppel/twin/entities/entity.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/base/core/near_names.h"

namespace doppel {
namespace {

// The parts of "scope::link::shape".
std::vector<std::string> parts_of(const std::string& name) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t at; (at = name.find("::", begin)) != std::string::npos; begin = at + 2)
    parts.push_back(name.substr(begin, at - begin));
  parts.push_back(name.substr(begin));
  return parts;
}

std::vector<std::string> instance_names(const Scene& scene) {
  std::vector<std::string> out;
  for (const std::vector<int>* some : {&scene.robots(), &scene.objects()}) {
    for (const int index : *some) out.push_back(scene.instance(index).name());
  }
  return out;
}

std::vector<std::string> link_names(const Scene& scene, int robot) {
  std::vector<std::string> out;
  for (const ModelLink& link : scene.instance(robot).model().links) out.push_back(link.name);
  return out;
}

// The robot with this name; -1: none.
int robot_named(const Scene& scene, std::string_view name) {
  const int index = scene.find(name);
  return index >= 0 && scene.is_robot(index) ? index : -1;
}

// The one robot in which `find` has a result, which is returned in `part`. Refuses if there is none (empty
// reason) or several.
template <class Find>
Status find_in_robots(const Scene& scene, const std::string& name, const Find& find, int& robot, int& part) {
  robot = part = -1;
  for (const int index : scene.robots()) {
    const int found = find(scene.instance(index).model());
    if (found < 0) continue;
    if (robot >= 0) {
      return Status::refused(fmt::format("'{}' exists in several robots; write for example '{}::{}'",
                                         name.substr(0, kMaxNameLength), scene.instance(robot).name(),
                                         name.substr(0, kMaxNameLength)));
    }
    robot = index;
    part = found;
  }
  return {};
}

Status refusal(const Scene& scene, const std::string& name, const std::vector<std::string>& parts) {
  const int scope = parts.size() > 1 ? robot_named(scene, parts.front()) : -1;
  std::vector<std::string> names;
  if (scope >= 0) {
    names = link_names(scene, scope);
  } else {
    names = instance_names(scene);
    if (parts.size() == 1) {
      for (const int robot : scene.robots()) {
        for (std::string& link : link_names(scene, robot)) names.push_back(std::move(link));
      }
    }
  }
  const std::string& wrong = scope >= 0 ? parts[1] : parts.front();
  return Status::refused(fmt::format("there is no entity '{}'{}", name.substr(0, kMaxNameLength),
                                     names_near(wrong.substr(0, kMaxNameLength), names)));
}

}  // namespace

bool is_world(const std::string& frame) {
  return frame.empty() || frame == "world" || frame == "map";
}

bool find_object(const Scene& scene, const std::string& name, Entity& entity) {
  // The names of objects and links may contain "::" themselves: the longest object's name wins.
  for (std::size_t end = name.size();; end = name.rfind("::", end - 1)) {
    if (end == std::string::npos || end == 0) return false;
    const int index = scene.find(name.substr(0, end));
    if (index < 0 || !scene.is_object(index)) continue;
    const ModelInstance& object = scene.instance(index).made_of();
    entity = {{index, object.base_link()}, false, object.X_BO};
    if (end == name.size()) return true;
    std::string link = name.substr(end + 2);
    if (const int found = object.model->find_link(link); found >= 0) {
      entity = {{index, found}, false, Pose::Identity()};
      return true;
    }
    const std::size_t shape = link.rfind("::");
    if (shape != std::string::npos) entity.X_BE = shape_in_object(scene.instance(index));
    link = link.substr(0, shape);
    const bool one_link = object.model->links.size() == (object.floating() ? 2u : 1u);
    return (one_link || shape != std::string::npos) && link.find("::") == std::string::npos;
  }
}

Status find_scalar_joint(const Scene& scene, const std::string& name, int& robot, int& joint) {
  const auto find = [](const std::string& plain) {
    return [&plain](const Model& model) {
      const int index = model.find_joint(plain);
      return index >= 0 && model.joints[static_cast<std::size_t>(index)].scalar() ? index : -1;
    };
  };
  if (const Status one = find_in_robots(scene, name, find(name), robot, joint); !one || robot >= 0)
    return one;
  const std::size_t scope = name.find("::");
  if (scope != std::string::npos) {
    robot = robot_named(scene, name.substr(0, scope));
    const std::string plain = name.substr(scope + 2);
    if (robot >= 0) joint = find(plain)(scene.instance(robot).model());
    if (joint >= 0) return {};
  }
  std::vector<std::string> names;
  for (const int index : scene.robots()) {
    for (const std::string& known : scene.instance(index).model().scalar_joint_names())
      names.push_back(scene.robots().size() > 1 ? scene.scoped(index, known) : known);
  }
  return Status::refused(fmt::format("there is no moving joint '{}'{}", name, did_you_mean(name, names)));
}

Status find_link(const Scene& scene, const std::string& name, BodyId& body) {
  const std::size_t scope = name.rfind("::");
  const std::string plain = scope == std::string::npos ? name : name.substr(scope + 2);
  const int named = scope == std::string::npos ? -1 : robot_named(scene, name.substr(0, scope));
  if (named >= 0) {
    body = {named, scene.instance(named).model().find_link(plain)};
  } else if (const Status one = find_in_robots(
                 scene, plain, [&](const Model& model) { return model.find_link(plain); }, body.instance,
                 body.link);
             !one) {
    return one;
  }
  if (body.link >= 0) return {};
  std::vector<std::string> names;
  for (const int robot : scene.robots()) {
    for (std::string& link : link_names(scene, robot)) names.push_back(std::move(link));
  }
  for (const int object : scene.objects()) names.push_back(scene.instance(object).name());
  return Status::refused(
      fmt::format("there is no link and no object '{}'{}", plain, did_you_mean(plain, names)));
}

Status find_entity(const Scene& scene, const std::string& name, Entity& entity) {
  if (find_object(scene, name, entity)) return {};
  entity = {{}, true, Pose::Identity()};
  const std::vector<std::string> parts = parts_of(name);
  if (const int robot = robot_named(scene, name); robot >= 0) {
    const ModelInstance& made = scene.instance(robot).made_of();
    entity.body = {robot, made.base_link()};
    entity.X_BE = made.X_BO;
    return {};
  }
  if (parts.size() == 2) {
    entity.body.instance = robot_named(scene, parts.front());
    entity.body.link =
        entity.body.instance < 0 ? -1 : scene.instance(entity.body.instance).model().find_link(parts.back());
  } else if (parts.size() == 1) {
    const auto find = [&name](const Model& model) { return model.find_link(name); };
    if (const Status one = find_in_robots(scene, name, find, entity.body.instance, entity.body.link); !one)
      return one;
  } else {
    entity.body.link = -1;
  }
  return entity.body.instance >= 0 && entity.body.link >= 0 ? Status() : refusal(scene, name, parts);
}

EntityMotion motion_of(const Scene& scene, const Entity& entity) {
  const Instance instance = scene.instance(entity.body.instance);
  EntityMotion out;
  out.X_WE = instance.link_pose(entity.body.link);
  out.velocity = instance.link_velocity(entity.body.link);
  if (entity.X_BE.matrix() == Pose::Identity().matrix()) return out;
  const Pose X_WF = out.X_WE * entity.X_BE;
  out.velocity.linear_W += out.velocity.angular_W.cross(X_WF.translation() - out.X_WE.translation());
  out.X_WE = X_WF;
  return out;
}

Status find_frame(const Scene& scene, const std::string& name, EntityMotion& frame) {
  if (is_world(name)) {
    frame = {scene.world_in_tf().inverse(), {}};
    return {};
  }
  Entity entity;
  if (const Status found = find_entity(scene, name, entity); !found)
    return Status::refused("the frame of reference is unknown: " + found.why());
  frame = motion_of(scene, entity);
  return {};
}

std::vector<LinkVisual> visuals_of(const ModelInstance& object) {
  std::vector<LinkVisual> visuals, collisions;
  for (std::size_t i = 0; i < object.model->links.size(); ++i) {
    const Link* const link = object.description->find_link(object.model->links[i].name);
    if (link == nullptr) continue;
    for (const Visual& one : link->visuals)
      visuals.push_back(
          {static_cast<int>(i), &one.geometry, &one.origin, one.material ? &*one.material : nullptr});
    for (const Collision& one : link->collisions)
      collisions.push_back({static_cast<int>(i), &one.geometry, &one.origin, nullptr});
  }
  return visuals.empty() ? collisions : visuals;
}

Pose shape_in_object(const Instance& object) {
  const std::vector<LinkVisual> visuals = visuals_of(object.made_of());
  if (visuals.empty()) return Pose::Identity();
  const LinkVisual& first = visuals.front();
  return object.base_pose().inverse() * object.link_pose(first.link) * first.origin->pose();
}

}  // namespace doppel
