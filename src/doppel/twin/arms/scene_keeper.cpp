#include "doppel/twin/arms/detail/scene_keeper.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/base/core/thrown.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/twin/arms/detail/arm_messages.h"
#include "doppel/twin/arms/detail/scene_messages.h"

namespace doppel {
namespace {

using moveit_msgs::msg::AttachedCollisionObject;
using moveit_msgs::msg::CollisionObject;
using moveit_msgs::msg::PlanningSceneWorld;

// The poses of a robot's links and of named frames at the time of a message.
class Frames {
 public:
  explicit Frames(const ArmSnapshot& snapshot) : snapshot_(snapshot), data_(snapshot.model()) {
    forward_kinematics(snapshot.model(), data_, snapshot.q);
    X_WR_ = snapshot.X_RW().inverse(Eigen::Isometry);
  }

  // Throws MoveItError for a frame that there is not.
  [[nodiscard]] Pose in_world(const std::string& frame) const {
    return X_WR_ * pose_in_root(snapshot_, snapshot_.q, frame, Pose::Identity());
  }
  // Throws InputError "scene.attached" for a link that there is not.
  [[nodiscard]] Pose link_in_world(const std::string& link) const {
    const Model& model = snapshot_.model();
    const int index = model.find_link(link);
    if (index < 0) {
      throw InputError(
          "scene.attached", {},
          fmt::format("the robot has no link '{}'{}", link, did_you_mean(link, model.link_names())));
    }
    return X_WR_ * data_.X_WL[static_cast<std::size_t>(index)];
  }
  [[nodiscard]] SceneObjects::LinkPose links() const {
    return [this](const std::string& link) { return link_in_world(link); };
  }

 private:
  const ArmSnapshot& snapshot_;
  Data data_;
  Pose X_WR_ = Pose::Identity();
};

// An object with the name of one that physics moves would be two obstacles of one name.
void require_new_name(const ArmSnapshot& snapshot, const std::string& id) {
  if (snapshot.world == nullptr) return;
  const auto& instances = snapshot.world->instances();
  if (std::ranges::find(instances, id, &ModelInstance::name) == instances.end()) return;
  throw InputError("scene.object", {}, fmt::format("the twin's world has an object '{}' already", id),
                   "it is an obstacle as it is; choose another name");
}

void apply_to(SceneObjects& scene, const ArmSnapshot& snapshot, const CollisionObject& message) {
  const Frames frames(snapshot);
  switch (message.operation) {
    case CollisionObject::ADD:
      require_new_name(snapshot, message.id);
      return scene.add(object_from(message, frames.in_world(message.header.frame_id)));
    case CollisionObject::APPEND:
      require_new_name(snapshot, message.id);
      return scene.append(object_from(message, frames.in_world(message.header.frame_id)));
    case CollisionObject::MOVE:
      return scene.move(message.id,
                        frames.in_world(message.header.frame_id) * object_pose(message.pose, message.id),
                        shape_poses(message));
    case CollisionObject::REMOVE:
      return scene.remove(message.id);
    default:
      break;
  }
  throw InputError("scene.object", {},
                   fmt::format("object '{}': there is no operation {}", message.id, message.operation),
                   "it is ADD 0, REMOVE 1, APPEND 2 or MOVE 3");
}

void apply_to(SceneObjects& scene, const ArmSnapshot& snapshot, const AttachedCollisionObject& message) {
  const Frames frames(snapshot);
  const CollisionObject& object = message.object;
  if (object.operation == CollisionObject::REMOVE)
    return scene.detach(object.id, message.link_name, frames.links());
  const Pose X_LW = frames.link_in_world(message.link_name).inverse(Eigen::Isometry);
  const bool has_shapes = !object.primitives.empty() || !object.meshes.empty() || !object.planes.empty();
  SceneObject held =
      object_from(object, has_shapes ? X_LW * frames.in_world(object.header.frame_id) : Pose::Identity());
  held.link = message.link_name;
  held.touch_links = message.touch_links;
  for (const std::string& link : held.touch_links) (void)frames.link_in_world(link);
  scene.attach(std::move(held), frames.links(), object.operation == CollisionObject::APPEND);
}

// False: `work` has thrown, and one line of the reason is in `refused`.
template <class Work>
bool attempt(std::vector<std::string>& refused, const Work& work) {
  try {
    work();
    return true;
  } catch (const MoveItError& problem) {
    refused.push_back(problem.message);
  } catch (const InputError& problem) {
    const Diagnostic& first = problem.diagnostics().front();
    refused.push_back(first.fix.empty() ? first.message : first.message + "; " + first.fix);
  } catch (...) {
    refused.push_back(thrown_text());
  }
  return false;
}

}  // namespace

std::shared_ptr<const SceneObjects> SceneKeeper::current() const {
  const std::lock_guard lock(mutex_);
  return objects_;
}

// `change` has a copy of the objects, which replaces them if something of it is done.
template <class Change>
std::vector<std::string> SceneKeeper::change(Change change) {
  const auto before = current();
  auto objects =
      before == nullptr ? std::make_shared<SceneObjects>() : std::make_shared<SceneObjects>(*before);
  std::vector<std::string> refused;
  if (!change(*objects, refused)) return refused;
  const std::lock_guard lock(mutex_);
  objects_ = std::move(objects);
  return refused;
}

std::vector<std::string> SceneKeeper::apply(const ArmSnapshot& snapshot, const CollisionObject& message) {
  return change([&](SceneObjects& scene, std::vector<std::string>& refused) {
    return attempt(refused, [&] { apply_to(scene, snapshot, message); });
  });
}

std::vector<std::string> SceneKeeper::apply(const ArmSnapshot& snapshot,
                                            const AttachedCollisionObject& message) {
  return change([&](SceneObjects& scene, std::vector<std::string>& refused) {
    return attempt(refused, [&] { apply_to(scene, snapshot, message); });
  });
}

std::vector<std::string> SceneKeeper::apply(const ArmSnapshot& snapshot, const PlanningSceneWorld& message) {
  return change([&](SceneObjects& scene, std::vector<std::string>& refused) {
    scene.remove("");
    for (const CollisionObject& object : message.collision_objects)
      attempt(refused, [&] { apply_to(scene, snapshot, object); });
    attempt(refused, [&] {
      const octomap_msgs::msg::OctomapWithPose& map = message.octomap;
      if (map.octomap.data.empty()) return;
      const Pose X_WM = Frames(snapshot).in_world(map.header.frame_id) * object_pose(map.origin, kOctomapId);
      scene.set_octomap(cells_from(map.octomap), X_WM);
    });
    return true;
  });
}

}  // namespace doppel
