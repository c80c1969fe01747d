// The compiled world: MuJoCo's model, and the indices of the instances' parts in its arrays.

#include "doppel/physics/engines/mujoco/mujoco_world.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <stdexcept>
#include <utility>

#include "doppel/physics/contract/grasp.h"
#include "doppel/physics/engines/mujoco/state_data.h"
#include "doppel/physics/mjcf/mjcf.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel {
namespace {

constexpr double kNeverNear = -1e9;           // m, the margin of a pair that never touches
constexpr double kMinCoupledInertia = 1e-12;  // kg m^2 or kg, of a leader with its mimics

int find_part(const mjModel* m, int type, const std::string& name) {
  const int id = mj_name2id(m, type, name.c_str());
  if (id < 0) throw std::logic_error("the compiled MuJoCo model lacks " + name);
  return id;
}

bool needs_contact_rules(const ModelInstance& instance) {
  const auto directed = [](const CollisionShape& shape) { return !shape.friction.plain(); };
  return !instance.rolling.empty() || std::ranges::any_of(instance.shapes, [&directed](const auto& shapes) {
    return std::ranges::any_of(shapes, directed);
  });
}

}  // namespace

void write_qpos(std::span<const double> q, int first, std::span<const int> quaternions, double* qpos) {
  std::copy(q.begin(), q.end(), qpos + first);
  for (const int at : quaternions) {
    if (at < first || at >= first + static_cast<int>(q.size())) continue;
    const double* const c = q.data() + (at - first);
    quaternion_to_mujoco(Eigen::Quaterniond(c[3], c[0], c[1], c[2]).normalized(), qpos + at);
  }
}

void read_qpos(const double* qpos, std::span<const int> quaternions, std::span<double> q) {
  std::copy_n(qpos, q.size(), q.begin());
  for (const int at : quaternions) {
    const Eigen::Quaterniond rotation = quaternion_from_mujoco(qpos + at);
    std::copy_n(rotation.coeffs().data(), 4, q.data() + at);  // x y z w
  }
}

MujocoWorld::MujocoWorld(WorldSettings settings, std::vector<ModelInstance> instances,
                         const CompiledWorld* before, Diagnostics& diagnostics)
    : CompiledWorld(std::move(settings), std::move(instances)),
      offsets_(instance_offsets(CompiledWorld::instances())) {
  Exclusions exclusions(this->settings(), CompiledWorld::instances());
  const MjcfDocument document = write_document(this->settings(), CompiledWorld::instances(), exclusions);
  compile(document, diagnostics);
  number_bodies();
  collect_joints();
  collect_contact_rules();
  find_exclusions(exclusions, before, document.exclusions);
  excluded_ = exclusions.list();
}

namespace {

// MuJoCo 2 has a matrix of all rows of constraints by all rows.
void refuse_size(std::span<const ModelInstance> instances) {
  const MjcfSizes sizes = sizes_of(instances);
  const double machine =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  const auto rows = static_cast<double>(sizes.rows);
  const double left = std::sqrt(machine / sizeof(mjtNum)) - static_cast<double>(kRowsOfRobot * sizes.robots);
  const double fit = std::max(0.0, 100 * std::floor(left / kRowsOfLooseShape / 100));
  throw InputError(
      "physics.too_large", {},
      fmt::format(
          "MuJoCo gets no memory for the {} shapes of the world that move and {} robot{}: it needs "
          "{:.0f} GB, which grows with the square of their number; beside {} robot{}, fewer than {:.0f} "
          "shapes fit into the {:.0f} GB of this machine",
          sizes.loose, sizes.robots, sizes.robots == 1 ? "" : "s", rows * rows * sizeof(mjtNum) / 1e9,
          sizes.robots, sizes.robots == 1 ? "" : "s", fit, machine / 1e9),
      "make what need not move static, or leave models out");
}

void fill_fields(const MjcfDocument& document, mjModel& m) {
  for (std::size_t i = 0; i < document.fields.size(); ++i) {
    const HeightField& field = *document.fields[i];
    const int id = find_part(&m, mjOBJ_HFIELD, mjcf_field_name(i));
    const float low = std::ranges::min(field.heights);
    const double rise = m.hfield_size[4 * id + 2];
    std::ranges::transform(field.heights, m.hfield_data + m.hfield_adr[id],
                           [&](float h) { return static_cast<float>((h - low) / rise); });
  }
}

}  // namespace

void MujocoWorld::compile(const MjcfDocument& document, Diagnostics& diagnostics) {
  std::string message;
  model_ = compile_mjcf(document.text, message);
  if (model_ == nullptr) {
    if (message.find("could not create mjData") != std::string::npos) refuse_size(instances());
    throw InputError(
        "physics.refused", {},
        "the physics engine rejects the robot or its world: " + in_user_terms(message, instances()));
  }
  fill_fields(document, *model_);
  const double bytes = sizeof(mjtNum) * static_cast<double>(model_->njmax) * std::max(model_->nv, 1);
  const int room =
      static_cast<int>(std::clamp(kMaxRowBytes / bytes, 1.0, static_cast<double>(kRoomOfStates)));
  model_->nconmax *= room;
  model_->njmax *= room;
  if (!message.empty()) {
    diagnostics.warning("physics.engine", {}, "physics engine: " + in_user_terms(message, instances()));
  }
}

void MujocoWorld::number_bodies() {
  ids_.assign(static_cast<std::size_t>(m()->nbody), BodyId{});
  islands.instance_of_body.assign(ids_.size(), -1);
  // MuJoCo's compiler precomputes the inertia of bodies on slides along principal axes, without an armature
  // that is written later.
  std::fill_n(model_->dof_simplenum, m()->nv, 0);
  for (std::size_t i = 0; i < instances().size(); ++i) {
    islands.first_dof.push_back(offsets_[i].v);
    for (int link = 0; link < static_cast<int>(instances()[i].model->links.size()); ++link) {
      const int body = find_part(m(), mjOBJ_BODY, mjcf_link_name(offsets_[i].link + link));
      bodies_.push_back(body);
      ids_[static_cast<std::size_t>(body)] = {static_cast<int>(i), link};
      model_->body_simple[body] = 0;
      islands.instance_of_body[static_cast<std::size_t>(body)] = static_cast<int>(i);
      const ModelLink& of = instances()[i].model->links[static_cast<std::size_t>(link)];
      if (of.weightless && of.inertia) weightless.push_back({body, of.inertia->mass, of.inertia->com});
    }
  }
  islands.first_dof.push_back(m()->nv);
}

void MujocoWorld::collect_joints() {
  joint_damping.assign(static_cast<std::size_t>(m()->nv), 0.0);
  for (int i = 0; i < static_cast<int>(instances().size()); ++i) {
    const InstanceOffsets& at = offsets(i);
    for (const Drive& drive : make_drives(instance(i), settings())) {
      drive_of_joint.resize(static_cast<std::size_t>(at.joint + drive.joint()), -1);
      drive_of_joint.push_back(static_cast<int>(drives.size()));
      drives.push_back(drive);
      JointSpring spring = spring_of_joint(*instance(i).model, drive.joint());
      spring.joint += at.joint;
      spring.q += at.q;
      spring.v += at.v;
      springs.push_back(spring);
    }
    for (const ModelJoint& joint : instance(i).model->joints) {
      if (joint.nv == 0) continue;
      std::fill_n(joint_damping.begin() + at.v + joint.v, joint.nv, joint.damping);
      if (joint.type == JointType::floating) {
        turning.push_back(at.v + joint.v + 3);
        if (instance(i).model->nv == joint.nv)
          loose.push_back({mujoco_body(i, joint.child_link), at.v + joint.v + 3});
        quaternions.push_back(at.q + joint.q + 3);
      }
      const int index = static_cast<int>(&joint - instance(i).model->joints.data());
      const int in_mujoco = find_part(m(), mjOBJ_JOINT, mjcf_joint_name(at.joint + index));
      if (m()->jnt_qposadr[in_mujoco] != at.q + joint.q || m()->jnt_dofadr[in_mujoco] != at.v + joint.v)
        throw std::logic_error("MuJoCo orders the joints differently from the models");
    }
    collect_stops(i);
    couple_mimics(i);
    joints = at.joint + static_cast<int>(instance(i).model->joints.size());
  }
  drive_of_joint.resize(static_cast<std::size_t>(joints), -1);
}

// MuJoCo scales the softness of a row by the inverse inertia of its joints as if each of them were free: a
// leader without inertia would make its couplings and limits yield to any load. Each joint of a coupled group
// gets the inverse inertia of the whole group instead. A coupling is written in the unit of the joint that
// moves further, so that the sum of the two inverses, which MuJoCo uses, is that of the row within a factor
// of two.
void MujocoWorld::couple_mimics(int index) {
  const Model& model = *instance(index).model;
  if (std::ranges::none_of(model.joints, [](const ModelJoint& joint) { return joint.mimics(); })) return;
  const InstanceOffsets& at = offsets(index);
  const Eigen::VectorXd inertia = carried_inertia(model);
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const ModelJoint& joint = model.joints[j];
    if (!joint.scalar() || !joint.mimics() || joint.mimic_multiplier == 0) continue;
    const ModelJoint& leader = model.joints[static_cast<std::size_t>(joint.mimic_leader)];
    const double ratio = joint.mimic_multiplier;
    const double inverse = 1.0 / std::max(inertia[joint.mimic_leader], kMinCoupledInertia);
    model_->dof_invweight0[at.v + leader.v] = inverse;
    model_->dof_invweight0[at.v + joint.v] = ratio * ratio * inverse;
    if (std::abs(ratio) >= 1) continue;
    const int own = find_part(m(), mjOBJ_JOINT, mjcf_joint_name(at.joint + static_cast<int>(j)));
    for (int i = 0; i < m()->neq; ++i) {
      if (m()->eq_type[i] != mjEQ_JOINT || m()->eq_obj1id[i] != own) continue;
      std::swap(model_->eq_obj1id[i], model_->eq_obj2id[i]);
      model_->eq_data[mjNEQDATA * i] = -joint.mimic_offset / ratio;
      model_->eq_data[mjNEQDATA * i + 1] = 1.0 / ratio;
      break;
    }
  }
}

void MujocoWorld::collect_contact_rules() {
  std::vector<RuledShape> shapes(static_cast<std::size_t>(m()->ngeom));
  std::vector<GripShape> grips(static_cast<std::size_t>(m()->ngeom));
  std::vector<std::optional<double>> restitutions(static_cast<std::size_t>(m()->ngeom));
  std::vector<bool> of_objects(static_cast<std::size_t>(m()->ngeom));
  bool moves = false;  // an object
  if (settings().ground) {
    const auto ground = static_cast<std::size_t>(find_part(m(), mjOBJ_GEOM, kMjcfGround));
    shapes[ground].friction = uniform_friction(settings().ground_friction);
    restitutions[ground] = settings().ground_restitution;
    of_objects[ground] = true;
  }
  for (int i = 0; i < static_cast<int>(instances().size()); ++i) {
    const bool ruled = needs_contact_rules(instance(i));
    moves = moves || (instance(i).is_object() && instance(i).model->nv > 0);
    for (std::size_t link = 0; link < instance(i).shapes.size(); ++link) {
      for (std::size_t k = 0; k < instance(i).shapes[link].size(); ++k) {
        const int in_all = offsets(i).link + static_cast<int>(link);
        const int geom = find_part(m(), mjOBJ_GEOM, mjcf_shape_name(in_all, k));
        const Friction& friction = instance(i).shapes[link][k].friction;
        of_objects[static_cast<std::size_t>(geom)] = instance(i).is_object();
        restitutions[static_cast<std::size_t>(geom)] = instance(i).shapes[link][k].restitution;
        const int of = friction.direction_link >= 0 ? friction.direction_link : static_cast<int>(link);
        shapes[static_cast<std::size_t>(geom)] = {friction, mujoco_body(i, of), ruled};
        const int body = m()->geom_bodyid[geom];
        grips[static_cast<std::size_t>(geom)] = {has_fingers(instance(i)) ? i : -1,
                                                 can_be_held(instance(i)) ? body : -1, body};
      }
    }
  }
  contact_rules = ContactRules(settings().friction_rule, std::move(shapes), std::move(grips),
                               moves ? std::move(of_objects) : std::vector<bool>{});
  bounces = Bounces(std::move(restitutions));
}

void MujocoWorld::collect_stops(int index) {
  const Model& model = *instance(index).model;
  const InstanceOffsets& at = offsets(index);
  for (JointSpring spring : make_stops(model)) {
    CompiledStop stop;
    stop.restitution = model.joints[static_cast<std::size_t>(spring.joint)].stop_restitution;
    stop.moved.emplace_back(at.v + spring.v, 1.0);
    for (const ModelJoint& other : model.joints) {
      if (other.mimic_leader == spring.joint) stop.moved.emplace_back(at.v + other.v, other.mimic_multiplier);
    }
    spring.joint += at.joint;
    spring.q += at.q;
    spring.v += at.v;
    stop.spring = spring;
    stops.push_back(std::move(stop));
  }
}

// MuJoCo finds a limited number of contacts at a time, so the search is repeated until it finds
// no further ones.
void MujocoWorld::find_exclusions(Exclusions& exclusions, const CompiledWorld* before,
                                  const std::vector<std::pair<BodyId, BodyId>>& excludable) {
  std::vector<int> signatures;
  for (std::size_t i = 0; i < excludable.size(); ++i)
    signatures.push_back(m()->exclude_signature[find_part(m(), mjOBJ_EXCLUDE, mjcf_exclusion_name(i))]);
  if (before != nullptr) exclusions.keep(*before);
  const DataHandle data = make_data(m());
  std::vector<double> q;
  for (const ModelInstance& instance : instances())
    q.insert(q.end(), instance.q0.data(), instance.q0.data() + instance.q0.size());
  write_qpos(q, 0, quaternions, data->qpos);
  const auto is_new = [&](BodyId body) {
    if (body.is_ground()) return false;
    const int earlier = before->find(instance(body.instance).name);
    return earlier < 0 ||
           before->instances()[static_cast<std::size_t>(earlier)].model != instance(body.instance).model;
  };
  bool found = true;
  while (found) {
    found = false;
    apply(exclusions, excludable, signatures);
    if (!guarded([this, &data] {
          mj_kinematics(m(), data.get());
          mj_comPos(m(), data.get());
          mj_collision(m(), data.get());
        })) {
      return;
    }
    for (int i = 0; i < data->ncon; ++i) {
      const Contact contact = describe(data->contact[i]);
      // Earlier instances have moved since their start, so only pairs of a new instance's own links and pairs
      // of them with the ground are excluded.
      const bool counts = before == nullptr || (is_new(contact.a) && is_new(contact.b)) ||
                          (is_new(contact.a) && contact.b.is_ground()) ||
                          (is_new(contact.b) && contact.a.is_ground());
      found = (counts && exclusions.note(contact)) || found;
    }
  }
}

// Disables contacts of exactly the excluded pairs.
void MujocoWorld::apply(const Exclusions& exclusions,
                        const std::vector<std::pair<BodyId, BodyId>>& excludable,
                        const std::vector<int>& signatures) {
  for (int i = 0; i < m()->npair; ++i) {
    const BodyId a = body_of(m()->geom_bodyid[m()->pair_geom1[i]]);
    const BodyId b = body_of(m()->geom_bodyid[m()->pair_geom2[i]]);
    model_->pair_margin[i] = exclusions.contains(a, b) ? kNeverNear : 0.0;
  }
  std::vector<int> excluded;
  for (std::size_t i = 0; i < excludable.size(); ++i) {
    if (exclusions.contains(excludable[i].first, excludable[i].second)) excluded.push_back(signatures[i]);
  }
  // MuJoCo searches the table in ascending order; entries above every signature are never reached.
  std::sort(excluded.begin(), excluded.end());
  excluded.resize(static_cast<std::size_t>(m()->nexclude), std::numeric_limits<int>::max());
  std::copy(excluded.begin(), excluded.end(), model_->exclude_signature);
}

Contact MujocoWorld::describe(const mjContact& contact) const {
  Contact out;
  out.a = body_of(m()->geom_bodyid[contact.geom1]);
  out.b = body_of(m()->geom_bodyid[contact.geom2]);
  out.p_W = Eigen::Map<const Eigen::Vector3d>(contact.pos);
  out.normal_W = Eigen::Map<const Eigen::Vector3d>(contact.frame);
  out.depth = -contact.dist;
  out.friction = contact.friction[0];
  return out;
}

std::shared_ptr<const CompiledWorld> MujocoWorld::with(std::vector<ModelInstance> instances,
                                                       Diagnostics& diagnostics) const {
  return std::make_shared<const MujocoWorld>(settings(), std::move(instances), this, diagnostics);
}

}  // namespace doppel
