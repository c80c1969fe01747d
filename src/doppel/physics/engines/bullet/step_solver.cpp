// The integration of a step: semi-implicit Euler over Bullet's articulated-body algorithm. Drives, stops and
// joint damping are evaluated at the velocity of the step's end: their terms on the mass matrix's diagonal
// are part of the inverse that Bullet's constraint solver uses, and so are the couplings of mimics, so that
// contacts, friction and limits are solved consistently with the step.

#include "doppel/physics/engines/bullet/step_solver.h"

#include <algorithm>
#include <cmath>

#include "doppel/physics/contract/detail/contact_rule.h"
#include "doppel/physics/contract/detail/gyroscopic.h"

namespace doppel {
namespace {

constexpr double kRunaway = 1e10;             // rad/s, m/s, rad/s^2 or m/s^2
constexpr double kJointErrorReduction = 0.2;  // of a mimic's or a limit's error in one step
constexpr double kNearLimit = 0.05;           // rad or m: distance within which a limit has a constraint row
constexpr double kUnbounded = 1e30;           // N m s or N s

}  // namespace

StepSolver::StepSolver(const BulletWorld& world)
    : world_(world), step_(to_seconds(world.settings().step)), solver_(step_, world.settings().gravity) {
  for (std::size_t i = 0; i < world.compiled().size(); ++i) {
    const Articulation& articulation = world.compiled()[i].articulation;
    first_tree_.push_back(static_cast<int>(trees_.size()));
    for (int tree = 0; tree < static_cast<int>(articulation.trees.size()); ++tree) {
      const int index = static_cast<int>(trees_.size());
      const int size = articulation.trees[static_cast<std::size_t>(tree)].size();
      trees_.push_back(std::unique_ptr<TreeScratch>(new TreeScratch{
          static_cast<int>(i), TreeDynamics(*world.instances()[i].model, articulation, tree, index),
          Eigen::VectorXd::Zero(size), Eigen::VectorXd::Zero(size), Eigen::VectorXd::Zero(size),
          Eigen::MatrixXd::Zero(size, size), Eigen::MatrixXd::Zero(size, size)}));
      solver_trees_.push_back({&trees_.back()->dynamics, &trees_.back()->inverse});
    }
  }
  std::size_t springs = 0;
  for (const BulletInstance& of : world.compiled()) springs = std::max(springs, of.springs.size());
  wanted_.reserve(springs);
  make_colliders();
}

void StepSolver::make_colliders() {
  for (int i = 0; i < static_cast<int>(world_.compiled().size()); ++i) {
    auto& of_instance = collider_of_group_.emplace_back();
    for (const RigidGroup& group : compiled(i).articulation.groups) {
      if (group.tree >= 0) {
        colliders_.push_back(
            std::make_unique<btMultiBodyLinkCollider>(&tree_at(i, group.tree).dynamics.body(), group.body));
      } else {
        colliders_.push_back(std::make_unique<btCollisionObject>());
      }
      of_instance.push_back(colliders_.back().get());
      bodies_.push_back(colliders_.back().get());
    }
  }
  ground_.setWorldTransform(btTransform::getIdentity());
  bodies_.push_back(&ground_);
  std::vector<btCollisionObject*> of_pieces;
  for (const Piece& piece : world_.pieces())
    of_pieces.push_back(collider_of_group_[static_cast<std::size_t>(piece.link.instance)]
                                          [static_cast<std::size_t>(piece.group)]);
  finder_ = std::make_unique<ContactFinder>(world_.pieces(), world_.pairs(), std::move(of_pieces), ground_,
                                            world_.settings());
  piece_poses_.resize(world_.pieces().size());
}

void StepSolver::load(int instance, const InstanceState& state) {
  for (std::size_t tree = 0; tree < compiled(instance).articulation.trees.size(); ++tree)
    tree_at(instance, static_cast<int>(tree)).dynamics.load(state.q, state.v, state.X_WR, scratch_);
}

// -- reading

Pose StepSolver::group_pose(int instance, int group, const Pose& X_WR) const {
  const RigidGroup& of = compiled(instance).articulation.groups[static_cast<std::size_t>(group)];
  return of.tree < 0 ? X_WR : tree_at(instance, of.tree).dynamics.pose(of.body);
}

Pose StepSolver::link_pose(int instance, int link, const InstanceState& state) const {
  const Articulation& articulation = compiled(instance).articulation;
  const auto at = static_cast<std::size_t>(link);
  return group_pose(instance, articulation.group_of_link[at], state.X_WR) * articulation.X_BL[at];
}

FrameVelocity StepSolver::link_velocity(int instance, int link) const {
  const Articulation& articulation = compiled(instance).articulation;
  const auto at = static_cast<std::size_t>(link);
  const RigidGroup& group = articulation.groups[static_cast<std::size_t>(articulation.group_of_link[at])];
  if (group.tree < 0) return {};
  const TreeDynamics& dynamics = tree_at(instance, group.tree).dynamics;
  const Eigen::Vector3d arm = dynamics.pose(group.body).linear() * articulation.X_BL[at].translation();
  return {dynamics.linear(group.body) + dynamics.angular(group.body).cross(arm),
          dynamics.angular(group.body)};
}

RayHit StepSolver::cast_ray(const Eigen::Vector3d& from_W, const Eigen::Vector3d& direction_W,
                            const std::vector<InstanceState>& states) const {
  RayHit hit;
  const double length = direction_W.norm();
  if (!(length > 0)) return hit;
  const Eigen::Vector3d along_W = direction_W / length;
  const auto take = [&hit](double distance, BodyId body) {
    if (distance >= 0 && (hit.distance < 0 || distance < hit.distance)) hit = {distance, body};
  };
  if (world_.settings().ground && from_W.z() >= 0 && along_W.z() < 0) take(-from_W.z() / along_W.z(), {});
  for (const Piece& piece : world_.pieces()) {
    const auto instance = static_cast<std::size_t>(piece.link.instance);
    const Pose X_SW = (group_pose(piece.link.instance, piece.group, states[instance].X_WR) * piece.X_BS)
                          .inverse(Eigen::Isometry);
    take(ray_distance(piece, X_SW * from_W, X_SW.linear() * along_W), piece.link);
  }
  return hit;
}

double StepSolver::kinetic_energy() const {
  double out = 0.0;
  for (const auto& tree : trees_) {
    for (const RigidGroup& group : compiled(tree->instance).articulation.groups) {
      if (group.tree < 0 || &tree_at(tree->instance, group.tree) != tree.get()) continue;
      const Eigen::Vector3d turning =
          tree->dynamics.pose(group.body).linear().transpose() * tree->dynamics.angular(group.body);
      out += 0.5 * (group.mass * tree->dynamics.linear(group.body).squaredNorm() +
                    turning.dot(group.moments.cwiseProduct(turning)));
    }
  }
  return out;
}

double StepSolver::potential_energy() const {
  double out = 0.0;
  for (const auto& tree : trees_) {
    for (const RigidGroup& group : compiled(tree->instance).articulation.groups) {
      if (group.tree < 0 || &tree_at(tree->instance, group.tree) != tree.get()) continue;
      out -= group.weighing * world_.settings().gravity.dot(tree->dynamics.pose(group.body) * group.p_BoG);
    }
  }
  return out;
}

// -- a step

void StepSolver::find_contacts(const std::vector<InstanceState>& states) {
  for (std::size_t i = 0; i < collider_of_group_.size(); ++i) {
    for (std::size_t group = 0; group < collider_of_group_[i].size(); ++group) {
      collider_of_group_[i][group]->setWorldTransform(
          to_bullet(group_pose(static_cast<int>(i), static_cast<int>(group), states[i].X_WR)));
    }
  }
  for (std::size_t i = 0; i < piece_poses_.size(); ++i) {
    const Piece& piece = world_.pieces()[i];
    const Pose& X_WR = states[static_cast<std::size_t>(piece.link.instance)].X_WR;
    piece_poses_[i] = group_pose(piece.link.instance, piece.group, X_WR) * piece.X_BS;
  }
  finder_->find(piece_poses_);
}

// Damping of floating joints, explicit: no realistic damping of a floating body is too stiff for the step.
void StepSolver::add_floating_damping(int instance) {
  const BulletInstance& of = compiled(instance);
  for (const ModelJoint& joint : world_.instances()[static_cast<std::size_t>(instance)].model->joints) {
    if (joint.type != JointType::floating || !(joint.damping > 0)) continue;
    const auto link = static_cast<std::size_t>(joint.child_link);
    const RigidGroup& group =
        of.articulation.groups[static_cast<std::size_t>(of.articulation.group_of_link[link])];
    const FrameVelocity moving = link_velocity(instance, joint.child_link);
    TreeDynamics& dynamics = tree_at(instance, group.tree).dynamics;
    const Eigen::Vector3d force = -joint.damping * moving.linear_W;
    const Eigen::Vector3d arm = dynamics.pose(group.body).linear() * of.articulation.X_BL[link].translation();
    dynamics.add_load(group.body, force, arm.cross(force) - joint.damping * moving.angular_W);
  }
}

// The gyroscopic torques of the bodies that move freely and are alone (detail/gyroscopic.h).
void StepSolver::add_gyroscopic_corrections(int instance) {
  const BulletInstance& of = compiled(instance);
  for (const RigidGroup& group : of.articulation.groups) {
    if (group.tree < 0) continue;
    const Tree& tree = of.articulation.trees[static_cast<std::size_t>(group.tree)];
    if (tree.floating_joint < 0 || !tree.links.empty()) continue;
    TreeDynamics& dynamics = tree_at(instance, group.tree).dynamics;
    const Eigen::Matrix3d R_WB = dynamics.pose(group.body).linear();
    const Eigen::Vector3d torque =
        gyroscopic_correction(group.moments, R_WB.transpose() * dynamics.angular(group.body), step_);
    dynamics.add_load(group.body, Eigen::Vector3d::Zero(), R_WB * torque);
  }
}

// Gravity, wrenches, external efforts and the joints' damping.
void StepSolver::write_loads(int instance, const InstanceState& state) {
  const BulletInstance& of = compiled(instance);
  for (std::size_t tree = 0; tree < of.articulation.trees.size(); ++tree)
    tree_at(instance, static_cast<int>(tree)).dynamics.clear_loads();
  for (const RigidGroup& group : of.articulation.groups) {
    if (group.tree < 0 || !(group.weighing > 0)) continue;
    TreeDynamics& dynamics = tree_at(instance, group.tree).dynamics;
    const Eigen::Vector3d weight = group.weighing * world_.settings().gravity;
    const Eigen::Vector3d arm = dynamics.pose(group.body).linear() * group.p_BoG;
    dynamics.add_load(group.body, weight, arm.cross(weight));
  }
  for (std::size_t link = 0; link < state.wrenches.size(); ++link) {
    const LinkWrench& wrench = state.wrenches[link];
    const RigidGroup& group =
        of.articulation.groups[static_cast<std::size_t>(of.articulation.group_of_link[link])];
    if (!wrench.on || group.tree < 0) continue;
    TreeDynamics& dynamics = tree_at(instance, group.tree).dynamics;
    const Eigen::Vector3d arm =
        dynamics.pose(group.body).linear() * (of.articulation.X_BL[link] * wrench.p_LoP_L);
    dynamics.add_load(group.body, wrench.force_W, wrench.torque_W + arm.cross(wrench.force_W));
  }
  add_floating_damping(instance);
  add_gyroscopic_corrections(instance);
  for (int v = 0; v < static_cast<int>(state.v.size()); ++v) {
    const ArticulationPlace place = place_of(instance, v);
    const auto at = static_cast<std::size_t>(v);
    if (place.tree >= 0)
      tree_at(instance, place.tree)
          .dynamics.add_effort(place.index, state.applied[at] - of.damping[at] * state.v[at]);
  }
}

// Adds inertia to one degree of freedom of the inverse and of the accelerations: a rank-one update by the
// Sherman-Morrison formula instead of another factorisation.
void StepSolver::add_implicit(int instance, int v, double armature) {
  if (!(armature > 0)) return;
  const ArticulationPlace place = place_of(instance, v);
  TreeScratch& tree = tree_at(instance, place.tree);
  const auto column = tree.inverse.col(place.index);
  tree.velocity = column;  // a copy, because the column changes while it is used
  const double share = armature / (1.0 + armature * tree.velocity[place.index]);
  tree.acceleration -= share * tree.acceleration[place.index] * tree.velocity;
  tree.inverse.noalias() -= share * tree.velocity * tree.velocity.transpose();
}

// The velocities of the step's end without contacts and constraint rows.
void StepSolver::respond(int instance, const InstanceState& state) {
  const BulletInstance& of = compiled(instance);
  for (std::size_t t = 0; t < of.articulation.trees.size(); ++t) {
    TreeScratch& tree = tree_at(instance, static_cast<int>(t));
    tree.inverse = tree.bare_inverse;
    tree.acceleration = tree.bare_acceleration;
  }
  for (const JointSpring& spring : state.springs) {
    if (!spring.on) continue;
    const ArticulationPlace place = place_of(instance, spring.v);
    const double effort = spring.bound != 0 ? spring.effort_at_bound()
                                            : spring.law(state.q[static_cast<std::size_t>(spring.q)],
                                                         state.v[static_cast<std::size_t>(spring.v)], 0.0);
    TreeScratch& tree = tree_at(instance, place.tree);
    tree.acceleration += effort * tree.bare_inverse.col(place.index);
  }
  for (int v = 0; v < static_cast<int>(state.v.size()); ++v) {
    if (place_of(instance, v).tree >= 0)
      add_implicit(
          instance, v,
          state.rotors[static_cast<std::size_t>(v)] + step_ * of.damping[static_cast<std::size_t>(v)]);
  }
  for (const JointSpring& spring : state.springs) {
    if (spring.acts_linearly()) add_implicit(instance, spring.v, step_ * spring.damping);
  }
  for (std::size_t t = 0; t < of.articulation.trees.size(); ++t) {
    TreeScratch& tree = tree_at(instance, static_cast<int>(t));
    tree.velocity = tree.dynamics.velocity() + step_ * tree.acceleration;
  }
  couple_mimics(instance, state);
  for (std::size_t t = 0; t < of.articulation.trees.size(); ++t) {
    TreeScratch& tree = tree_at(instance, static_cast<int>(t));
    tree.dynamics.write_velocity(tree.velocity);
  }
}

// Removes the freedom of each mimic against its leader from the velocity and the inverse. As rows of Bullet's
// iterative solver the couplings of a leader much lighter than its followers would not converge.
void StepSolver::couple_mimics(int instance, const InstanceState& state) {
  const Model& model = *world_.instances()[static_cast<std::size_t>(instance)].model;
  for (const ModelJoint& joint : model.joints) {
    if (!joint.scalar() || !joint.mimics()) continue;
    const ModelJoint& leader = model.joints[static_cast<std::size_t>(joint.mimic_leader)];
    const ArticulationPlace own = place_of(instance, joint.v);
    const auto a = own.index, b = place_of(instance, leader.v).index;
    const double ratio = joint.mimic_multiplier;
    TreeScratch& tree = tree_at(instance, own.tree);
    tree.acceleration = tree.inverse.col(a) - ratio * tree.inverse.col(b);  // response to a unit impulse
    const double response = tree.acceleration[a] - ratio * tree.acceleration[b];
    if (!(response > 0)) continue;
    const double error = state.q[static_cast<std::size_t>(joint.q)] -
                         ratio * state.q[static_cast<std::size_t>(leader.q)] - joint.mimic_offset;
    const double rate = tree.velocity[a] - ratio * tree.velocity[b];
    tree.velocity -= (rate + kJointErrorReduction / step_ * error) / response * tree.acceleration;
    tree.inverse.noalias() -= tree.acceleration * (tree.acceleration.transpose() / response);
  }
}

void StepSolver::meet_stops(int instance, InstanceState& state) {
  const Model& model = *world_.instances()[static_cast<std::size_t>(instance)].model;
  const auto moved = [&](int joint) {
    const ArticulationPlace place = place_of(instance, model.joints[static_cast<std::size_t>(joint)].v);
    return 1.0 / tree_at(instance, place.tree).bare_inverse(place.index, place.index);
  };
  for (std::size_t k = state.drives.size(); k < state.springs.size(); ++k) {
    JointSpring& stop = state.springs[k];
    if (!meet_stop(stop, state.q[static_cast<std::size_t>(stop.q)])) continue;
    double inertia = moved(stop.joint);
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      const double rate = model.joints[j].mimic_multiplier;
      if (model.joints[j].mimic_leader == stop.joint) inertia += rate * rate * moved(static_cast<int>(j));
    }
    hit_stop(stop, model.joints[static_cast<std::size_t>(stop.joint)].stop_restitution, inertia, step_);
  }
}

void StepSolver::write_joint_rows(int instance, const InstanceState& state, const ModelJoint& joint) {
  const BulletInstance& of = compiled(instance);
  const int first = of.articulation.places[static_cast<std::size_t>(joint.v)].index;
  JointRow row;
  row.tree = first_tree_[static_cast<std::size_t>(instance)] +
             of.articulation.places[static_cast<std::size_t>(joint.v)].tree;
  for (int k = 0; k < joint.nv && joint.friction > 0; ++k) {
    row.place_a = first + k;
    row.high = joint.friction * step_;
    row.low = -row.high;
    rows_.push_back(row);
  }
  if (!joint.scalar()) return;
  row.place_a = first;
  const double q = state.q[static_cast<std::size_t>(joint.q)];
  if (joint.stop_stiffness > 0) return;
  const double near = kNearLimit + 2.0 * step_ * std::abs(end_velocity(instance, joint.v));
  row.low = 0.0;
  row.high = kUnbounded;
  // Inside the limits the row lets the joint reach the limit exactly; beyond a limit it removes the fraction
  // kJointErrorReduction of the error per step.
  const auto stop = [&](double room, double direction) {
    if (!(room < near)) return;
    row.factor_a = direction;
    row.target = -room / step_ * (room > 0 ? 1.0 : kJointErrorReduction);
    rows_.push_back(row);
  };
  stop(q - joint.lower, 1.0);
  stop(joint.upper - q, -1.0);
}

void StepSolver::write_rows(int instance, const InstanceState& state) {
  for (const ModelJoint& joint : world_.instances()[static_cast<std::size_t>(instance)].model->joints) {
    if (joint.nv > 0 && joint.type != JointType::floating) write_joint_rows(instance, state, joint);
  }
}

double StepSolver::end_velocity(int instance, int v) const {
  const ArticulationPlace place = place_of(instance, v);
  return tree_at(instance, place.tree).velocity[place.index];
}

// The unbounded effort at the velocity of the step's end and the position of its start.
double StepSolver::asked_effort(int instance, const InstanceState& state, const JointSpring& spring) const {
  return spring.law(state.q[static_cast<std::size_t>(spring.q)], end_velocity(instance, spring.v), 0.0);
}

// False: a spring has met or left a bound, and the step has to be repeated.
bool StepSolver::settle(std::vector<InstanceState>& states, int pass) {
  bool settled = true;
  for (std::size_t i = 0; i < states.size(); ++i) {
    std::vector<JointSpring>& springs = states[i].springs;
    wanted_.resize(springs.size());
    for (std::size_t k = 0; k < springs.size(); ++k) {
      if (springs[k].on) wanted_[k] = asked_effort(static_cast<int>(i), states[i], springs[k]);
    }
    if (rebound(springs, wanted_, pass)) settled = false;
  }
  return settled;
}

bool StepSolver::finite() const {
  return std::ranges::all_of(trees_, [this](const auto& tree) {
    return ((tree->velocity - tree->dynamics.velocity()).array().abs() < kRunaway * step_).all() &&
           (tree->velocity.array().abs() < kRunaway).all();
  });
}

void StepSolver::report_efforts(int instance, InstanceState& state) const {
  for (std::size_t k = 0; k < state.drives.size(); ++k) {
    const JointSpring& spring = state.springs[k];
    state.effort[static_cast<std::size_t>(spring.joint)] =
        !spring.on          ? 0.0
        : spring.bound != 0 ? spring.effort_at_bound()
                            : std::clamp(asked_effort(instance, state, spring), spring.low, spring.high);
  }
}

bool StepSolver::solve(std::vector<InstanceState>& states) {
  find_contacts(states);
  const int count = static_cast<int>(states.size());
  for (int i = 0; i < count; ++i) write_loads(i, states[static_cast<std::size_t>(i)]);
  for (const auto& tree : trees_)
    tree->dynamics.forward_dynamics(scratch_, tree->bare_acceleration, tree->bare_inverse);
  for (int i = 0; i < count; ++i) meet_stops(i, states[static_cast<std::size_t>(i)]);
  for (int pass = 0;; ++pass) {
    rows_.clear();
    for (int i = 0; i < count; ++i) {
      respond(i, states[static_cast<std::size_t>(i)]);
      write_rows(i, states[static_cast<std::size_t>(i)]);
    }
    if (!finite()) return false;
    solver_.solve(solver_trees_, rows_, bodies_, finder_->manifolds());
    for (const auto& tree : trees_) tree->dynamics.read_velocity(tree->velocity);
    if (!finite()) return false;
    if (settle(states, pass)) break;
  }
  for (int i = 0; i < count; ++i) report_efforts(i, states[static_cast<std::size_t>(i)]);
  return true;
}

void StepSolver::integrate(std::vector<InstanceState>& states) const {
  for (const auto& tree : trees_) {
    InstanceState& state = states[static_cast<std::size_t>(tree->instance)];
    tree->dynamics.integrate(tree->velocity, step_, state.X_WR, state.q, state.v);
  }
}

void StepSolver::contacts(std::vector<Contact>& out) {
  out.clear();
  for (std::size_t i = 0; i < finder_->manifolds().size(); ++i) {
    btPersistentManifold& manifold = *finder_->manifolds()[i];
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold.getContactPoint(k);
      // Bullet also reports pairs that are only near; without touch or impulse they are not contacts.
      if (point.getDistance() > 0 && !(point.m_appliedImpulse > 0)) continue;
      Contact contact;
      contact.a = world_.link_of(finder_->pair_of(i).first);
      contact.b = world_.link_of(finder_->pair_of(i).second);
      contact.p_W =
          0.5 * (from_bullet(point.getPositionWorldOnA()) + from_bullet(point.getPositionWorldOnB()));
      contact.normal_W = -from_bullet(point.m_normalWorldOnB);
      contact.force_W = -from_bullet(point.m_normalWorldOnB * point.m_appliedImpulse +
                                     point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1 +
                                     point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2) /
                        step_;
      contact.depth = -point.getDistance();
      contact.friction = point.m_combinedFriction;
      out.push_back(contact);
    }
  }
}

}  // namespace doppel
