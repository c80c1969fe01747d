#include "doppel/physics/engines/bullet/tree_dynamics.h"

namespace doppel {
namespace {

Eigen::Quaterniond turned_by(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (!(angle > 0)) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation_vector / angle));
}

}  // namespace

TreeDynamics::TreeDynamics(const Model& model, const Articulation& articulation, int tree, int index)
    : model_(model), tree_(articulation.trees[static_cast<std::size_t>(tree)]) {
  const RigidGroup& base = articulation.groups[static_cast<std::size_t>(tree_.base_group)];
  X_TB_ = base.X_TB;
  const auto links = static_cast<int>(tree_.links.size());
  const bool fixed = tree_.floating_joint < 0;
  const bool can_sleep = false;
  body_ = std::make_unique<btMultiBody>(
      links, fixed ? 0.0 : base.mass, fixed ? btVector3(0, 0, 0) : to_bullet(base.moments), fixed, can_sleep);
  for (int i = 0; i < links; ++i) setup_link(i, articulation);
  body_->finalizeMultiDof();
  // Bullet's defaults are made for games: they damp 4 % of the velocity per second and limit it to 100 rad/s.
  body_->setLinearDamping(0.0);
  body_->setAngularDamping(0.0);
  body_->setMaxCoordinateVelocity(SIMD_INFINITY);
  body_->setMaxAppliedImpulse(SIMD_INFINITY);
  body_->setUseGyroTerm(true);  // else w x I w is missing, as if every inertia were spherical
  body_->setUserIndex(index);
  const auto bodies = static_cast<std::size_t>(links) + 1;
  poses_.assign(bodies, Pose::Identity());
  linear_.assign(bodies, Eigen::Vector3d::Zero());
  angular_.assign(bodies, Eigen::Vector3d::Zero());
  loaded_.setZero(size());
  force_.setZero(size());
}

void TreeDynamics::setup_link(int index, const Articulation& articulation) {
  const TreeLink& link = tree_.links[static_cast<std::size_t>(index)];
  const RigidGroup none;
  const RigidGroup& group = link.group < 0 ? none : articulation.groups[static_cast<std::size_t>(link.group)];
  const btQuaternion parent_to_this = rotation_to_bullet(link.X_PB.linear().transpose());
  const auto setup = link.kind == Axis::turn ? &btMultiBody::setupRevolute : &btMultiBody::setupPrismatic;
  const bool disable_parent_collision = true;  // exclusions.h decides which pairs collide
  (body_.get()->*setup)(index, group.mass, to_bullet(group.moments), link.parent, parent_to_this,
                        to_bullet(link.axis), to_bullet(link.p_PoJ), to_bullet(link.p_JoB),
                        disable_parent_collision);
}

Pose TreeDynamics::base_pose(std::span<const double> q, const Pose& X_WR) const {
  if (tree_.floating_joint < 0) return X_WR;
  const ModelJoint& joint = model_.joints[static_cast<std::size_t>(tree_.floating_joint)];
  const double* const at = q.data() + joint.q;
  Pose X_JL = Pose::Identity();
  X_JL.linear() = Eigen::Quaterniond(at[6], at[3], at[4], at[5]).normalized().toRotationMatrix();
  X_JL.translation() << at[0], at[1], at[2];
  return X_WR * joint.X_PJ * X_JL * X_TB_;
}

void TreeDynamics::load(std::span<const double> q, std::span<const double> v, const Pose& X_WR,
                        BulletScratch& scratch) {
  const Pose X_WB = base_pose(q, X_WR);
  body_->setBaseWorldTransform(to_bullet(X_WB));
  loaded_.setZero();
  if (tree_.floating_joint >= 0) {
    const ModelJoint& joint = model_.joints[static_cast<std::size_t>(tree_.floating_joint)];
    const Eigen::Map<const Eigen::Vector3d> linear(v.data() + joint.v), angular(v.data() + joint.v + 3);
    const Eigen::Matrix3d R_WL = X_WB.linear() * X_TB_.linear().transpose();
    loaded_.head<3>() = R_WL * angular;
    loaded_.segment<3>(3) =
        X_WR.linear() * joint.X_PJ.linear() * linear + loaded_.head<3>().cross(R_WL * X_TB_.translation());
  }
  for (std::size_t i = 0; i < tree_.links.size(); ++i) {
    const TreeLink& link = tree_.links[i];
    body_->setJointPos(static_cast<int>(i), q[static_cast<std::size_t>(link.q)]);
    loaded_[6 + static_cast<Eigen::Index>(i)] = v[static_cast<std::size_t>(link.v)];
  }
  write_velocity(loaded_);
  body_->forwardKinematics(scratch.rotations, scratch.origins);
  scratch.omega.resize(poses_.size());
  scratch.velocity.resize(poses_.size());
  body_->compTreeLinkVelocities(scratch.omega.data(), scratch.velocity.data());
  poses_[0] = X_WB;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (i > 0) poses_[i] = from_bullet(body_->getLink(static_cast<int>(i) - 1).m_cachedWorldTransform);
    angular_[i] = poses_[i].linear() * from_bullet(scratch.omega[i]);
    linear_[i] = poses_[i].linear() * from_bullet(scratch.velocity[i]);
  }
}

void TreeDynamics::write_velocity(const Eigen::VectorXd& velocity) {
  body_->setBaseOmega({velocity[0], velocity[1], velocity[2]});
  body_->setBaseVel({velocity[3], velocity[4], velocity[5]});
  for (int i = 0; i < body_->getNumLinks(); ++i) body_->setJointVel(i, velocity[6 + i]);
}

void TreeDynamics::read_velocity(Eigen::VectorXd& out) const {
  out = Eigen::Map<const Eigen::VectorXd>(body_->getVelocityVector(), size());
}

void TreeDynamics::integrate(const Eigen::VectorXd& velocity, double h, const Pose& X_WR, std::span<double> q,
                             std::span<double> v) const {
  for (std::size_t i = 0; i < tree_.links.size(); ++i) {
    const TreeLink& link = tree_.links[i];
    const double rate = velocity[6 + static_cast<Eigen::Index>(i)];
    q[static_cast<std::size_t>(link.q)] += h * rate;
    v[static_cast<std::size_t>(link.v)] = rate;
  }
  if (tree_.floating_joint < 0) return;
  const ModelJoint& joint = model_.joints[static_cast<std::size_t>(tree_.floating_joint)];
  const Eigen::Vector3d angular = velocity.head<3>(), linear = velocity.segment<3>(3);
  Pose X_WB = poses_[0];
  X_WB.translation() += h * linear;
  X_WB.linear() =
      (turned_by(h * angular) * Eigen::Quaterniond(X_WB.linear())).normalized().toRotationMatrix();
  const Pose X_WJ = X_WR * joint.X_PJ;
  const Pose X_JL = X_WJ.inverse(Eigen::Isometry) * X_WB * X_TB_.inverse(Eigen::Isometry);
  const Eigen::Quaterniond rotation = Eigen::Quaterniond(X_JL.linear()).normalized();
  const Eigen::Matrix3d R_WL = X_WJ.linear() * X_JL.linear();
  Eigen::Map<Eigen::Vector3d>(q.data() + joint.q) = X_JL.translation();
  Eigen::Map<Eigen::Vector4d>(q.data() + joint.q + 3) = rotation.coeffs();
  Eigen::Map<Eigen::Vector3d>(v.data() + joint.v) =
      X_WJ.linear().transpose() * (linear - angular.cross(R_WL * X_TB_.translation()));
  Eigen::Map<Eigen::Vector3d>(v.data() + joint.v + 3) = R_WL.transpose() * angular;
}

void TreeDynamics::clear_loads() {
  body_->clearForcesAndTorques();
}

void TreeDynamics::add_load(int body, const Eigen::Vector3d& force_W, const Eigen::Vector3d& torque_W) {
  if (body < 0) {
    body_->addBaseForce(to_bullet(force_W));
    body_->addBaseTorque(to_bullet(torque_W));
  } else {
    body_->addLinkForce(body, to_bullet(force_W));
    body_->addLinkTorque(body, to_bullet(torque_W));
  }
}

void TreeDynamics::add_effort(int place, double effort) {
  body_->addJointTorque(place - 6, effort);
}

void TreeDynamics::forward_dynamics(BulletScratch& scratch, Eigen::VectorXd& acceleration,
                                    Eigen::MatrixXd& inverse) {
  const double one_second = 1.0;  // Bullet adds acceleration * time to the velocities
  body_->computeAccelerationsArticulatedBodyAlgorithmMultiDof(one_second, scratch.r, scratch.v, scratch.m,
                                                              false, false, false);
  read_velocity(acceleration);
  acceleration -= loaded_;
  write_velocity(loaded_);
  inverse.setZero();
  const int first = tree_.floating_joint < 0 ? 6 : 0;
  for (int i = first; i < size(); ++i) {
    force_.setZero();
    force_[i] = 1.0;
    body_->calcAccelerationDeltasMultiDof(force_.data(), inverse.col(i).data(), scratch.r, scratch.v);
  }
  if (first > 0) inverse.topRows(6).setZero();
}

}  // namespace doppel
