#pragma once
// One tree of an instance as a btMultiBody, used for computation only: positions and velocities are written
// into it before each use, and derived quantities are read.

#include <memory>
#include <span>

#include "doppel/physics/engines/bullet/articulation.h"
#include "doppel/physics/engines/bullet/convert.h"

namespace doppel {

// Scratch of Bullet's algorithms, shared by the trees of one engine.
struct BulletScratch {
  btAlignedObjectArray<btScalar> r;
  btAlignedObjectArray<btVector3> v;
  btAlignedObjectArray<btMatrix3x3> m;
  btAlignedObjectArray<btQuaternion> rotations;
  btAlignedObjectArray<btVector3> origins;
  std::vector<btVector3> omega, velocity;
};

// Velocities have the order of Bullet: angular and linear velocity of the base's centre of mass in world
// axes, then the links.
class TreeDynamics {
 public:
  // `index` is the value that index_of() returns for the body.
  TreeDynamics(const Model& model, const Articulation& articulation, int tree, int index);

  [[nodiscard]] const Tree& tree() const { return tree_; }
  [[nodiscard]] int size() const { return tree_.size(); }
  [[nodiscard]] btMultiBody& body() { return *body_; }
  static int index_of(const btMultiBody& body) { return body.getUserIndex(); }

  // Writes positions and velocities of the model at X_WR and computes the frames.
  void load(std::span<const double> q, std::span<const double> v, const Pose& X_WR, BulletScratch& scratch);
  void write_velocity(const Eigen::VectorXd& velocity);
  [[nodiscard]] const Eigen::VectorXd& velocity() const { return loaded_; }  // as loaded
  void read_velocity(Eigen::VectorXd& out) const;
  // q and v of the model after `h` seconds at the constant velocity.
  void integrate(const Eigen::VectorXd& velocity, double h, const Pose& X_WR, std::span<double> q,
                 std::span<double> v) const;

  [[nodiscard]] const Pose& pose(int body) const { return poses_[static_cast<std::size_t>(body + 1)]; }
  // At the centre of mass.
  [[nodiscard]] const Eigen::Vector3d& linear(int body) const {
    return linear_[static_cast<std::size_t>(body + 1)];
  }
  [[nodiscard]] const Eigen::Vector3d& angular(int body) const {
    return angular_[static_cast<std::size_t>(body + 1)];
  }

  void clear_loads();
  void add_load(int body, const Eigen::Vector3d& force_W, const Eigen::Vector3d& torque_W);
  void add_effort(int place, double effort);
  // Accelerations under the loads, and the inverse of the mass matrix. Restores the loaded velocity.
  void forward_dynamics(BulletScratch& scratch, Eigen::VectorXd& acceleration, Eigen::MatrixXd& inverse);

 private:
  void setup_link(int index, const Articulation& articulation);
  [[nodiscard]] Pose base_pose(std::span<const double> q, const Pose& X_WR) const;

  const Model& model_;
  const Tree& tree_;
  Pose X_TB_;  // of the base
  std::unique_ptr<btMultiBody> body_;
  Eigen::VectorXd loaded_, force_;
  std::vector<Pose> poses_;  // [1 + links]
  std::vector<Eigen::Vector3d> linear_, angular_;
};

}  // namespace doppel
