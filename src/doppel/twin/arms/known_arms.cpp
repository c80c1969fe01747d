#include "doppel/twin/arms/detail/known_arms.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "doppel/base/core/names.h"
#include "doppel/robot/semantics/srdf_groups.h"
#include "doppel/scenario/resolve/described_arms.h"

namespace doppel {
namespace {

constexpr double kGroundSize = 1000;  // m: the slab that stands for the ground
constexpr const char* kGround = "ground";

bool same_attachments(const std::vector<Attachment>& a, const std::vector<Attachment>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Attachment& x, const Attachment& y) {
    return x.a == y.a && x.b == y.b && x.X_AB.isApprox(y.X_AB, 1e-9);
  });
}

SceneInstance ground_slab(const Pose& X_RW) {
  SceneInstance out;
  out.name = kGround;
  out.shapes = {
      {collision_shape(Box{Eigen::Vector3d::Constant(kGroundSize)}, nullptr, Pose::Identity(), Friction{})}};
  Pose X_WO = Pose::Identity();
  X_WO.translation().z() = -0.5 * kGroundSize;
  out.X_WR = X_RW * X_WO;
  return out;
}

}  // namespace

void KnownArms::show(const ArmSnapshot& snapshot) {
  const bool same_robot = now_.robot == snapshot.robot;
  const bool same_world = same_robot && now_.world == snapshot.world && now_.objects == snapshot.objects &&
                          same_attachments(now_.attachments, snapshot.attachments);
  now_ = snapshot;
  if (!same_robot) find_groups();
  if (!same_world) {
    arms_.clear();
    everything_.reset();
  }
  for (auto& [name, entry] : arms_) place(*entry.reach->context());
  if (everything_) place(*everything_);
}

void KnownArms::find_groups() {
  Diagnostics notes;
  PackageResolver resolver;
  if (now_.robot->target != nullptr) resolver.add_context(now_.robot->target->description);
  groups_ = described_arms(now_.model(), *now_.robot->description, now_.robot->target, resolver,
                           now_.robot->controllers, notes);
}

// Instances of the scene are those of the world without the robot itself, then the ground, then the objects
// of the planning scene.
ReachSurroundings KnownArms::surroundings() const {
  ReachSurroundings out;
  if (now_.world != nullptr) add_world(out);
  if (now_.objects == nullptr) return out;
  for (const auto& [id, object] : now_.objects->all()) {
    SceneInstance instance = scene_instance(object, X_RO(object));
    if (!object.link.empty()) {
      const int link = now_.model().find_link(object.link);
      if (link < 0) continue;  // the robot was reloaded without the link
      instance.held = HeldBy{{0, link}, object.X_PO};
      for (const std::string& name : object.touch_links) {
        if (const int touched = now_.model().find_link(name); touched >= 0)
          instance.held->touch_links.push_back(touched);
      }
    }
    out.others.push_back(std::move(instance));
  }
  return out;
}

// An object of the planning scene that no link holds, in the root link.
Pose KnownArms::X_RO(const SceneObject& object) const {
  return now_.X_RW() * object.X_PO;
}

void KnownArms::add_world(ReachSurroundings& out) const {
  const std::vector<ModelInstance>& instances = now_.world->instances();
  std::vector<int> index(instances.size(), 0);
  const Pose X_RW = now_.X_RW();
  const auto in_scene = [&index](BodyId body) {
    return BodyId{index[static_cast<std::size_t>(body.instance)], body.link};
  };
  for (int i = 0, next = 1; i < static_cast<int>(instances.size()); ++i) {
    if (i != now_.instance) index[static_cast<std::size_t>(i)] = next++;
  }
  for (int i = 0; i < static_cast<int>(instances.size()); ++i) {
    if (i == now_.instance) continue;
    const ModelInstance& source = instances[static_cast<std::size_t>(i)];
    SceneInstance other;
    other.name = source.name;
    other.model = source.model;
    other.shapes = source.shapes;
    other.X_WR = X_RW * now_.X_WL[static_cast<std::size_t>(i)][0];
    for (const Attachment& pair : now_.attachments) {
      const bool first = pair.a.instance == now_.instance && pair.b.instance == i;
      const bool second = pair.b.instance == now_.instance && pair.a.instance == i;
      if (!first && !second) continue;
      const BodyId holder = first ? pair.a : pair.b, body = first ? pair.b : pair.a;
      const Pose& X_WH =
          now_.X_WL[static_cast<std::size_t>(holder.instance)][static_cast<std::size_t>(holder.link)];
      other.held =
          HeldBy{{0, holder.link},
                 X_WH.inverse(Eigen::Isometry) * now_.X_WL[static_cast<std::size_t>(body.instance)][0]};
    }
    out.others.push_back(std::move(other));
  }
  const int ground = static_cast<int>(out.others.size()) + 1;
  if (now_.world->settings().ground) out.others.push_back(ground_slab(X_RW));
  for (const ExcludedPair& pair : now_.world->excluded_pairs()) {
    if (pair.a.instance == pair.b.instance) continue;
    const auto side = [&](BodyId body) { return body.is_ground() ? BodyId{ground, 0} : in_scene(body); };
    BodyId a = side(pair.a), b = side(pair.b);
    if (b < a) std::swap(a, b);
    if (b.instance <= static_cast<int>(out.others.size())) out.allowed.push_back({a, b, pair.reason});
  }
}

void KnownArms::place(CollisionContext& context) const {
  const Pose X_RW = now_.X_RW();
  const std::vector<SceneInstance>& instances = context.scene().instances();
  const auto is_held = [&instances](int k) {
    return instances[static_cast<std::size_t>(k)].held.has_value();
  };
  int next = 1;
  for (int i = 0; i < static_cast<int>(now_.X_WL.size()); ++i) {
    if (i == now_.instance) continue;
    const int k = next++;
    if (is_held(k)) continue;
    std::vector<Pose> poses = now_.X_WL[static_cast<std::size_t>(i)];
    for (Pose& X : poses) X = X_RW * X;
    context.set_link_poses(k, poses);
  }
  if (now_.world != nullptr && now_.world->settings().ground)
    context.set_root(next++, ground_slab(X_RW).X_WR);
  for (; next < static_cast<int>(instances.size()); ++next) {
    if (is_held(next)) continue;
    const SceneObject* const object = now_.objects->find(instances[static_cast<std::size_t>(next)].name);
    context.set_root(next, X_RO(*object));
  }
}

int KnownArms::link_named(const std::string& name) const {
  const Model& model = now_.model();
  const int link = model.find_link(name);
  if (link >= 0) return link;
  throw InputError("reach.unknown_link", {},
                   fmt::format("the robot has no link '{}'{}", name, did_you_mean(name, model.link_names())));
}

Chain KnownArms::chain_to(int base_link, int tip_link) const {
  const Model& model = now_.model();
  try {
    return make_chain(model, base_link, tip_link);
  } catch (const std::invalid_argument& reason) {
    throw InputError("reach.no_chain", {},
                     fmt::format("link '{}' cannot be moved from '{}': {}",
                                 model.links[static_cast<std::size_t>(tip_link)].name,
                                 model.links[static_cast<std::size_t>(base_link)].name, reason.what()));
  }
}

// The group that a link belongs to: it is on the chain, or below its end.
const ArmGroup* KnownArms::group_of_link(int link) const {
  const Model& model = now_.model();
  for (const ArmGroup& group : groups_) {
    const auto is_below = [&model](int upper, int lower) {
      return upper == lower || joints_between(model, upper, lower);
    };
    const ModelJoint& last = model.joints[static_cast<std::size_t>(group.chain.variables.back())];
    const bool on_chain = is_below(group.chain.base_link, link) && is_below(link, group.chain.tip_link);
    if (link != group.chain.base_link && (on_chain || is_below(last.child_link, link))) return &group;
  }
  return nullptr;
}

ArmReach& KnownArms::arm(const std::string& group_name, const std::string& tip) {
  const int wanted_tip = tip.empty() ? -1 : link_named(tip);
  const ArmGroup* chosen =
      group_name.empty() && wanted_tip >= 0 ? group_of_link(wanted_tip) : &group(group_name);
  // A link of no group is moved by all that is between it and the base.
  const int base_link = chosen != nullptr ? chosen->chain.base_link : now_.robot->base_link;
  const int tip_link = wanted_tip >= 0 ? wanted_tip : chosen->chain.tip_link;
  const auto key = std::pair(base_link, tip_link);
  const auto found = arms_.find(key);
  if (found != arms_.end()) return *found->second.reach;
  Chain chain = chain_to(base_link, tip_link);
  Diagnostics notes;
  Entry entry;
  entry.scene = reach_scene(*now_.robot->description, now_.robot->model, &chain, surroundings(), notes);
  entry.reach = std::make_unique<ArmReach>(now_.robot->model, std::move(chain), entry.scene);
  place(*entry.reach->context());
  return *arms_.emplace(key, std::move(entry)).first->second.reach;
}

std::string KnownArms::name_of_group(const std::string& group_name, const std::string& tip) const {
  if (!group_name.empty() || tip.empty()) return group(group_name).name;
  const ArmGroup* const found = group_of_link(link_named(tip));
  return found == nullptr ? "" : found->name;
}

std::shared_ptr<const CollisionScene> KnownArms::scene_of(const std::string& group_name) {
  (void)arm(group_name, "");
  const Chain& chain = group(group_name).chain;
  return arms_.at({chain.base_link, chain.tip_link}).scene;
}

CollisionContext& KnownArms::everything() {
  if (!everything_) {
    Diagnostics notes;
    everything_ = std::make_unique<CollisionContext>(
        reach_scene(*now_.robot->description, now_.robot->model, nullptr, surroundings(), notes));
    place(*everything_);
  }
  return *everything_;
}

}  // namespace doppel
