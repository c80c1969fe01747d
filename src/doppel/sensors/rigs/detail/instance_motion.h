#pragma once
// An instance over one step: the acceleration that changed its velocities, and what follows from it by inverse dynamics.

#include <Eigen/Core>
#include <vector>

#include "doppel/physics/contract/engine.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel {

class InstanceMotion {
 public:
  explicit InstanceMotion(const Model& model);

  // The state that was noted.
  struct Noted {
    Pose X_WR = Pose::Identity();
    Eigen::VectorXd q, v;
  };
  [[nodiscard]] const Noted& noted() const { return noted_; }
  void set_noted(const Noted& noted) { noted_ = noted; }

  // -- no allocation
  // The state from which a step begins.
  void note(const Instance& instance);
  // The acceleration of the step from there to the present state. h: the step, s.
  void differentiate(const Instance& instance, double h);
  // The present state as the one from which a step without acceleration begins.
  void note_at_rest(const Instance& instance);
  // data() and X_WL() are those of the state from which the step begins; gravity_W: m/s^2.
  void solve_start(const Eigen::Vector3d& gravity_W);
  // data() is that of the present state with the same acceleration.
  void solve_end(const Instance& instance, const Eigen::Vector3d& gravity_W);

  [[nodiscard]] const Data& data() const { return data_; }
  [[nodiscard]] const std::vector<Pose>& X_WL() const { return X_WL_; }  // [links], of solve_start()

 private:
  const Model& model_;
  Noted noted_;
  Eigen::VectorXd a_;
  std::vector<Pose> X_WL_;
  Data data_;
};

}  // namespace doppel
