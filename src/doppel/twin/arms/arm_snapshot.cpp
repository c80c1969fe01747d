#include "doppel/twin/arms/arm_snapshot.h"

#include "doppel/base/core/names.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {
namespace {

int link_of(const ArmSnapshot& snapshot, const std::string& name) {
  return snapshot.model().find_link(name);
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
  const auto body = find_body(snapshot, name);
  if (!body) return std::nullopt;
  return snapshot.X_RW() *
         snapshot.X_WL[static_cast<std::size_t>(body->instance)][static_cast<std::size_t>(body->link)];
}

std::string nearest_frame(const ArmSnapshot& snapshot, const std::string& name) {
  std::vector<std::string> names = snapshot.model().link_names();
  names.emplace_back("world");
  if (snapshot.world != nullptr) {
    for (const ModelInstance& instance : snapshot.world->instances()) names.push_back(instance.name);
  }
  return did_you_mean(name, names);
}

}  // namespace doppel
