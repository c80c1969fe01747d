#include "doppel/twin/arms/arm_snapshot.h"

#include "doppel/base/core/names.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {
namespace {

int link_of(const ArmSnapshot& snapshot, const std::string& name) {
  return snapshot.model().find_link(name);
}

const Pose& pose_of(const ArmSnapshot& snapshot, BodyId body) {
  return snapshot.X_WL[static_cast<std::size_t>(body.instance)][static_cast<std::size_t>(body.link)];
}

// The base link of an object, or its link of that name.
std::optional<BodyId> find_body(const ArmSnapshot& snapshot, const std::string& name) {
  if (snapshot.world == nullptr) return std::nullopt;
  const std::vector<ModelInstance>& instances = snapshot.world->instances();
  for (int i = 0; i < static_cast<int>(instances.size()); ++i) {
    const ModelInstance& instance = instances[static_cast<std::size_t>(i)];
    if (name == instance.name) return BodyId{i, instance.base_link()};
    if (!name.starts_with(instance.name + "/")) continue;
    const int link = instance.model->find_link(name.substr(instance.name.size() + 1));
    if (link >= 0) return BodyId{i, link};
  }
  return std::nullopt;
}

}  // namespace

Pose ArmSnapshot::X_RW() const {
  if (world == nullptr) return Pose::Identity();
  return X_WL[static_cast<std::size_t>(instance)][0].inverse(Eigen::Isometry);
}

std::optional<Pose> find_frame(const ArmSnapshot& snapshot, const Eigen::VectorXd& q, std::string name) {
  if (name.starts_with("/")) name.erase(0, 1);
  const std::string prefix = snapshot.robot->name_space.empty() ? "" : snapshot.robot->name_space + "/";
  if (!prefix.empty() && name.starts_with(prefix)) name.erase(0, prefix.size());
  Data data(snapshot.model());
  forward_kinematics(snapshot.model(), data, q);
  if (name.empty()) return data.X_WL[static_cast<std::size_t>(snapshot.robot->base_link)];
  if (const int link = link_of(snapshot, name); link >= 0) return data.X_WL[static_cast<std::size_t>(link)];
  if (name == "world" || name == "map" || name == "odom") return snapshot.X_RW();
  if (const auto body = find_body(snapshot, name)) return snapshot.X_RW() * pose_of(snapshot, *body);
  if (snapshot.objects == nullptr) return std::nullopt;
  const std::optional<ObjectFrame> frame = snapshot.objects->frame(name);
  if (!frame) return std::nullopt;
  if (frame->link.empty()) return snapshot.X_RW() * frame->X_PF;
  const int link = link_of(snapshot, frame->link);
  if (link < 0) return std::nullopt;  // the robot was reloaded without the link
  return data.X_WL[static_cast<std::size_t>(link)] * frame->X_PF;
}

std::optional<LinkFrame> find_held_frame(const ArmSnapshot& snapshot, const std::string& name) {
  if (const int link = link_of(snapshot, name); link >= 0) return LinkFrame{link};
  if (const auto body = find_body(snapshot, name)) {
    for (const Attachment& pair : snapshot.attachments) {
      const bool is_first = pair.a.instance == body->instance;
      const BodyId holder = is_first ? pair.b : pair.a;
      if ((!is_first && pair.b.instance != body->instance) || holder.instance != snapshot.instance) continue;
      const Pose X_LW = pose_of(snapshot, holder).inverse(Eigen::Isometry);
      return LinkFrame{holder.link, X_LW * pose_of(snapshot, *body)};
    }
    return std::nullopt;
  }
  const auto frame = snapshot.objects == nullptr ? std::nullopt : snapshot.objects->frame(name);
  if (!frame || frame->link.empty()) return std::nullopt;
  const int link = link_of(snapshot, frame->link);
  if (link < 0) return std::nullopt;
  return LinkFrame{link, frame->X_PF};
}

std::string nearest_frame(const ArmSnapshot& snapshot, const std::string& name) {
  std::vector<std::string> names = snapshot.model().link_names();
  names.emplace_back("world");
  if (snapshot.world != nullptr) {
    for (const ModelInstance& instance : snapshot.world->instances()) names.push_back(instance.name);
  }
  if (snapshot.objects != nullptr) {
    const std::vector<std::string> objects = snapshot.objects->frame_names();
    names.insert(names.end(), objects.begin(), objects.end());
  }
  return did_you_mean(name, names);
}

}  // namespace doppel
