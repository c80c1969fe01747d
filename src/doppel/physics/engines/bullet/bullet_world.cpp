#include "doppel/physics/engines/bullet/bullet_world.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {
namespace {

// A gear joins joints of one articulated body.
void refuse_mimics_across(const Model& model, const Articulation& articulation) {
  for (const ModelJoint& joint : model.joints) {
    if (!joint.mimics()) continue;
    const ModelJoint& leader = model.joints[static_cast<std::size_t>(joint.mimic_leader)];
    if (articulation.places[static_cast<std::size_t>(joint.v)].tree ==
        articulation.places[static_cast<std::size_t>(leader.v)].tree)
      continue;
    throw InputError("physics.mimic_across", {},
                     fmt::format("joint '{}' mimics '{}', which is in another floating subtree; Bullet "
                                 "couples joints of one subtree only",
                                 joint.name, leader.name),
                     "choose --engine mujoco, or put both joints into one subtree");
  }
}

BulletInstance compile(const ModelInstance& instance, const WorldSettings& settings) {
  const Model& model = *instance.model;
  BulletInstance out;
  out.articulation = make_articulation(model);
  refuse_mimics_across(model, out.articulation);
  out.drives = make_drives(instance, settings);
  out.drive_of_joint.assign(model.joints.size(), -1);
  for (const Drive& drive : out.drives) {
    out.drive_of_joint[static_cast<std::size_t>(drive.joint())] = static_cast<int>(out.springs.size());
    out.springs.push_back(spring_of_joint(model, drive.joint()));
  }
  for (const JointSpring& stop : make_stops(model)) out.springs.push_back(stop);
  out.damping.assign(static_cast<std::size_t>(model.nv), 0.0);
  for (const ModelJoint& joint : model.joints) {
    if (joint.nv > 0) std::fill_n(out.damping.begin() + joint.v, joint.nv, joint.damping);
  }
  return out;
}

}  // namespace

BulletWorld::BulletWorld(WorldSettings settings, std::vector<ModelInstance> instances,
                         const BulletWorld* before)
    : CompiledWorld(std::move(settings), std::move(instances)) {
  for (const ModelInstance& instance : CompiledWorld::instances())
    compiled_.push_back(compile(instance, this->settings()));
  collect_pieces();
  Exclusions exclusions(this->settings(), CompiledWorld::instances());
  if (before != nullptr) exclusions.keep(*before);
  list_pairs(exclusions);
  note_start(exclusions, before);
  list_pairs(exclusions);
  excluded_ = exclusions.list();
}

void BulletWorld::collect_pieces() {
  ShapeMaker maker;
  for (std::size_t i = 0; i < instances().size(); ++i) {
    const Articulation& articulation = compiled_[i].articulation;
    for (std::size_t link = 0; link < instances()[i].shapes.size(); ++link) {
      for (const CollisionShape& shape : instances()[i].shapes[link]) {
        if (std::holds_alternative<SharedField>(shape.geometry)) continue;  // EngineCapabilities::heightmaps
        pieces_.push_back({{static_cast<int>(i), static_cast<int>(link)},
                           articulation.group_of_link[link],
                           articulation.X_BL[link] * shape.X_LS,
                           shape.friction,
                           shape,
                           maker.make(shape)});
      }
    }
  }
}

void BulletWorld::list_pairs(const Exclusions& exclusions) {
  pairs_.clear();
  const int count = static_cast<int>(pieces_.size());
  for (int a = 0; a < count; ++a) {
    if (settings().ground && !exclusions.contains(link_of(a), {})) pairs_.push_back({a, -1});
    for (int b = a + 1; b < count; ++b) {
      if (link_of(a) != link_of(b) && !exclusions.contains(link_of(a), link_of(b))) pairs_.push_back({a, b});
    }
  }
}

bool BulletWorld::is_new(BodyId body, const BulletWorld& before) const {
  if (body.is_ground()) return false;
  const ModelInstance& instance = instances()[static_cast<std::size_t>(body.instance)];
  const int earlier = before.find(instance.name);
  return earlier < 0 || before.instances()[static_cast<std::size_t>(earlier)].model != instance.model;
}

void BulletWorld::note_start(Exclusions& exclusions, const BulletWorld* before) {
  std::vector<std::vector<Pose>> links;
  for (const ModelInstance& instance : instances()) {
    Data data(*instance.model);
    forward_kinematics(*instance.model, data, instance.q0);
    for (Pose& X_WL : data.X_WL) X_WL = instance.X_WR * X_WL;
    links.push_back(data.X_WL);
  }
  std::vector<Pose> poses;
  std::vector<btCollisionObject*> colliders;
  btCollisionObject anything, ground;
  for (const Piece& piece : pieces_) {
    const auto instance = static_cast<std::size_t>(piece.link.instance);
    poses.push_back(links[instance][static_cast<std::size_t>(piece.link.link)] * piece.source.X_LS);
    colliders.push_back(&anything);
  }
  ContactFinder finder(pieces_, pairs_, colliders, ground, settings());
  finder.find(poses);
  for (std::size_t i = 0; i < finder.manifolds().size(); ++i) {
    Contact contact;
    contact.a = link_of(finder.pair_of(i).first);
    contact.b = link_of(finder.pair_of(i).second);
    // Earlier instances have moved since their start, so only pairs of a new instance's own links and pairs
    // of them with the ground are excluded.
    const auto counts = [&](BodyId body, BodyId other) {
      return is_new(body, *before) && (other.is_ground() || is_new(other, *before));
    };
    if (before != nullptr && !counts(contact.a, contact.b) && !counts(contact.b, contact.a)) continue;
    btPersistentManifold& manifold = *finder.manifolds()[i];
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      contact.depth = -manifold.getContactPoint(k).getDistance();
      if (contact.depth >= 0) exclusions.note(contact);
    }
  }
}

std::shared_ptr<const CompiledWorld> BulletWorld::with(std::vector<ModelInstance> instances,
                                                       Diagnostics&) const {
  return std::make_shared<const BulletWorld>(settings(), std::move(instances), this);
}

}  // namespace doppel
