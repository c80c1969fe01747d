#include "doppel/twin/entity.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/core/names.h"
#include "doppel/twin/world_frame.h"

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

Status refusal(const Model& model, const Engine& engine, const std::string& name,
               const std::vector<std::string>& parts) {
  const bool wrong_link = parts.size() > 1 && parts.front() == model.name;
  std::vector<std::string> names;
  if (!wrong_link) {
    names.push_back(model.name);
    for (const WorldObject& object : engine.objects()) names.push_back(object.name);
  }
  if (wrong_link || parts.size() == 1) {
    for (const ModelLink& link : model.links) names.push_back(link.name);
  }
  const std::string& wrong = wrong_link ? parts[1] : parts.front();
  return Status::refused(fmt::format("there is no entity '{}'{}", name.substr(0, kLongestName),
                                     did_you_mean(wrong.substr(0, kLongestName), names)));
}

}  // namespace

const WorldObject* find_named(const std::vector<WorldObject>& objects, std::string_view name) {
  const auto found = std::ranges::find(objects, name, &WorldObject::name);
  return found == objects.end() ? nullptr : &*found;
}

bool is_world(const std::string& frame) {
  return frame.empty() || frame == "world" || frame == "map";
}

bool find_object(const Engine& engine, const std::string& name, Entity& entity) {
  const std::vector<std::string> parts = parts_of(name);
  if (parts.size() > 3 || find_named(engine.objects(), parts.front()) == nullptr) return false;
  entity = {-1, parts.front(), parts.size() == 3};
  return true;
}

Status find_entity(const Model& model, const Engine& engine, const std::string& name, Entity& entity) {
  if (find_object(engine, name, entity)) return {};
  const std::vector<std::string> parts = parts_of(name);
  const bool of_robot = parts.size() == 1 || (parts.size() == 2 && parts.front() == model.name);
  entity = {of_robot ? model.find_link(parts.back()) : -1, "", false};
  if (name == model.name) entity.link = 0;
  return entity.link >= 0 ? Status() : refusal(model, engine, name, parts);
}

EntityMotion motion_of(const Engine& engine, const Entity& entity) {
  EntityMotion out;
  if (entity.object.empty()) {
    out.X_WE = engine.link_pose(entity.link);
    out.velocity = engine.link_velocity(entity.link);
    return out;
  }
  engine.object_pose(entity.object, out.X_WE);
  engine.object_velocity(entity.object, out.velocity);
  if (!entity.shape) return out;
  const Pose X_WS = out.X_WE * shape_in_object(engine, entity.object);
  out.velocity.linear_W += out.velocity.angular_W.cross(X_WS.translation() - out.X_WE.translation());
  out.X_WE = X_WS;
  return out;
}

Status find_frame(const Model& model, const Engine& engine, const std::string& name, EntityMotion& frame) {
  if (is_world(name)) {
    frame = {world_in_tf(model, engine).inverse(), {}};
    return {};
  }
  Entity entity;
  if (const Status found = find_entity(model, engine, name, entity); !found)
    return Status::refused("the frame of reference is unknown: " + found.why());
  frame = motion_of(engine, entity);
  return {};
}

Pose shape_in_object(const Engine& engine, const std::string& object) {
  const WorldObject* found = find_named(engine.objects(), object);
  return found == nullptr ? Pose(Pose::Identity()) : found->X_OS;
}

}  // namespace doppel
