#include <algorithm>
#include <limits>
#include <stdexcept>

#include "doppel/physics/mujoco/convert.h"
#include "doppel/physics/mujoco/mujoco_state_detail.h"

namespace doppel {
namespace {

constexpr double kNeverNear = -1e9;  // m, the margin of a pair that never touches

int find(const mjModel* m, int type, const std::string& name) {
  const int id = mj_name2id(m, type, name.c_str());
  if (id < 0) throw std::logic_error("the compiled MuJoCo model lacks " + name);
  return id;
}

}  // namespace

MujocoState::MujocoState(const RobotMjcf& robot, const Model& model, const World& world,
                         CollisionMeshes& meshes, Diagnostics& diagnostics) {
  std::string message;
  model_ = compile_mjcf(write_document(robot, world, meshes, diagnostics), message);
  if (model_ == nullptr) {
    throw InputError(
        "physics.refused", {},
        "the physics engine refuses the robot or its world: " + in_user_terms(message, model, world));
  }
  if (!message.empty()) {
    diagnostics.warning("physics.engine", {},
                        "the physics engine says: " + in_user_terms(message, model, world));
  }
  data_.reset(mj_makeData(model_.get()));
  if (data_ == nullptr) throw std::bad_alloc();
  check_order(model);
  // MuJoCo takes the inertia of bodies on slides along principal axes from the compiler, without an armature
  // that is written later.
  std::fill_n(m()->dof_simplenum, model.nv, 0);
  body_links_.assign(static_cast<std::size_t>(m()->nbody), -1);
  body_objects_.assign(static_cast<std::size_t>(m()->nbody), -1);
  for (int i = 0; i < static_cast<int>(model.links.size()); ++i) {
    link_bodies_.push_back(find(m(), mjOBJ_BODY, mjcf_link_name(i)));
    body_links_[link_bodies_.back()] = i;
    m()->body_simple[link_bodies_.back()] = 0;
  }
  for (int i = 0; i < static_cast<int>(world.objects.size()); ++i) {
    MujocoObject object;
    object.body = find(m(), mjOBJ_BODY, mjcf_object_name(i));
    body_objects_[object.body] = i;
    if (m()->body_jntnum[object.body] > 0) {
      const int joint = m()->body_jntadr[object.body];
      object.q = m()->jnt_qposadr[joint];
      object.v = m()->jnt_dofadr[joint];
    }
    objects_.push_back(object);
  }
  if (!lists_pairs()) find_exclusions(robot, world);
  for (const WorldObject& object : world.objects) object_names_.push_back(object.name);
}

bool MujocoState::lists_pairs() const {
  return m()->opt.collision == mjCOL_PAIR;
}

void MujocoState::find_exclusions(const RobotMjcf& robot, const World& world) {
  const auto signature = [this](const std::string& name) {
    return m()->exclude_signature[find(m(), mjOBJ_EXCLUDE, name)];
  };
  for (std::size_t i = 0; i < robot.pairs.size(); ++i)
    exclusion_signatures_.push_back(signature(mjcf_exclusion_name(i)));
  for (std::size_t i = 0; i < robot.movable_shapes.size(); ++i) {
    for (int object = -1; object < static_cast<int>(world.objects.size()); ++object) {
      surroundings_.push_back({robot.movable_shapes[i],
                               object < 0 ? "ground" : world.objects[static_cast<std::size_t>(object)].name,
                               signature(mjcf_surrounding_name(i, object))});
    }
  }
}

void MujocoState::check_order(const Model& model) const {
  for (int i = 0; i < static_cast<int>(model.joints.size()); ++i) {
    if (model.joints[i].nv == 0) continue;
    const int joint = find(m(), mjOBJ_JOINT, mjcf_joint_name(i));
    if (m()->jnt_qposadr[joint] != model.joints[i].q || m()->jnt_dofadr[joint] != model.joints[i].v) {
      throw std::logic_error("MuJoCo orders the joints in another way than the model");
    }
  }
}

void MujocoState::apply_exclusions(const std::vector<LinkPair>& pairs, const std::vector<Overlap>& overlaps) {
  if (lists_pairs()) {
    for (int i = 0; i < m()->npair; ++i)
      m()->pair_margin[i] = passes_through(i, pairs, overlaps) ? kNeverNear : 0.0;
    return;
  }
  std::vector<int> excluded;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!pairs[i].reason.empty()) excluded.push_back(exclusion_signatures_[i]);
  }
  for (const Overlap& overlap : overlaps) {
    for (const Surrounding& near : surroundings_) {
      if (near.link == overlap.link && near.object == overlap.object) excluded.push_back(near.signature);
    }
  }
  // MuJoCo walks the table in ascending order; what is beyond every signature is never reached.
  std::sort(excluded.begin(), excluded.end());
  excluded.resize(static_cast<std::size_t>(m()->nexclude), std::numeric_limits<int>::max());
  std::copy(excluded.begin(), excluded.end(), m()->exclude_signature);
}

bool MujocoState::passes_through(int pair, const std::vector<LinkPair>& pairs,
                                 const std::vector<Overlap>& overlaps) const {
  const int body_a = m()->geom_bodyid[m()->pair_geom1[pair]],
            body_b = m()->geom_bodyid[m()->pair_geom2[pair]];
  const int a = std::min(link_of_body(body_a), link_of_body(body_b));
  const int b = std::max(link_of_body(body_a), link_of_body(body_b));
  if (b < 0) return false;
  if (a >= 0) {
    return std::any_of(pairs.begin(), pairs.end(),
                       [a, b](const LinkPair& of) { return of.a == a && of.b == b && !of.reason.empty(); });
  }
  const int object = std::max(object_of_body(body_a), object_of_body(body_b));
  const std::string name = object < 0 ? "ground" : object_names_[static_cast<std::size_t>(object)];
  return std::any_of(overlaps.begin(), overlaps.end(),
                     [&](const Overlap& of) { return of.link == b && of.object == name; });
}

void MujocoState::write_q(const Model& model, const double* q) {
  std::copy_n(q, model.nq, d()->qpos);
  for (const ModelJoint& joint : model.joints) {
    if (joint.type != JointType::floating) continue;
    const double* c = q + joint.q + 3;
    quaternion_to_mujoco(Eigen::Quaterniond(c[3], c[0], c[1], c[2]).normalized(), d()->qpos + joint.q + 3);
  }
}

void MujocoState::read_q(const Model& model, double* q) const {
  std::copy_n(d()->qpos, model.nq, q);
  for (const ModelJoint& joint : model.joints) {
    if (joint.type != JointType::floating) continue;
    const Eigen::Quaterniond rotation = quaternion_from_mujoco(d()->qpos + joint.q + 3);
    std::copy_n(rotation.coeffs().data(), 4, q + joint.q + 3);  // x y z w
  }
}

void MujocoState::place_object(std::size_t index, const Pose& X_WO) {
  const MujocoObject& object = objects_[index];
  double* position = object.q >= 0 ? d()->qpos + object.q : m()->body_pos + 3 * object.body;
  double* rotation = object.q >= 0 ? position + 3 : m()->body_quat + 4 * object.body;
  Eigen::Map<Eigen::Vector3d>(position, 3) = X_WO.translation();
  quaternion_to_mujoco(Eigen::Quaterniond(X_WO.linear()), rotation);
  if (object.v >= 0) std::fill_n(d()->qvel + object.v, 6, 0.0);
}

bool MujocoState::refresh() {
  return guarded([this] { mj_step1(m(), d()); });
}

}  // namespace doppel
