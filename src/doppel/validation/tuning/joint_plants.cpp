#include "doppel/validation/tuning/detail/joint_plants.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "doppel/base/math/mass_properties.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel {
namespace {

// v of all joints per unit of the velocity of each joint that is no mimic.
Eigen::MatrixXd moved_by(const Model& model, std::vector<int>& columns) {
  columns.assign(model.joints.size(), -1);
  int count = 0;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    if (model.joints[i].mimics() || model.joints[i].nv == 0) continue;
    columns[i] = count;
    count += model.joints[i].nv;
  }
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(model.nv, count);
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    if (joint.mimics()) {
      out(joint.v, columns[static_cast<std::size_t>(joint.mimic_leader)]) = joint.mimic_multiplier;
    } else {
      for (int k = 0; k < joint.nv; ++k) out(joint.v + k, columns[i] + k) = 1;
    }
  }
  return out;
}

void add_payload(const Subject& subject, const ToolLoad& tool, Model& model) {
  int link = model.find_link(tool.link);
  if (link < 0 && !subject.arms.empty()) link = subject.arms.front().chain.tip_link;
  if (link < 0) return;
  MassProperties load;
  load.mass = tool.mass;
  load.com = tool.p_LoC_L;
  auto& inertia = model.links[static_cast<std::size_t>(link)].inertia;
  inertia = inertia ? combined(*inertia, load) : load;
}

void measure(const Model& model, const Eigen::Vector3d& gravity_R, int configurations,
             std::vector<PlantLoad>& out) {
  std::vector<int> columns;
  const Eigen::MatrixXd moved = moved_by(model, columns);
  Data data(model);
  Eigen::VectorXd torques(static_cast<Eigen::Index>(model.joints.size()));
  for (const Eigen::VectorXd& q : sample_configurations(model, configurations)) {
    mass_matrix(model, data, q);
    const Eigen::MatrixXd held = moved.transpose() * data.M * moved;
    const Eigen::LDLT<Eigen::MatrixXd> solver(held);
    const Eigen::MatrixXd freed = solver.solve(Eigen::MatrixXd::Identity(held.rows(), held.cols()));
    gravity_torques(model, data, q, gravity_R);
    drive_torques(model, data, torques);
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (columns[i] < 0 || !model.joints[i].scalar()) continue;
      const double most = held(columns[i], columns[i]), inverse = freed(columns[i], columns[i]);
      const double least = std::isfinite(inverse) && inverse > 0 ? std::min(most, 1 / inverse) : most;
      PlantLoad& load = out[i];
      load.most_inertia = std::max(load.most_inertia, most);
      load.least_inertia = load.least_inertia > 0 ? std::min(load.least_inertia, least) : least;
      load.gravity = std::max(load.gravity, std::abs(torques[static_cast<Eigen::Index>(i)]));
    }
  }
}

}  // namespace

std::vector<PlantLoad> joint_loads(const Subject& subject, const ToolLoad& tool, int configurations) {
  const Model& model = *subject.model;
  std::vector<PlantLoad> out(model.joints.size());
  const Eigen::Vector3d& gravity_R = subject.robot().gravity_R();
  measure(model, gravity_R, configurations, out);
  if (tool.mass > 0) {
    Model loaded = model;
    add_payload(subject, tool, loaded);
    measure(loaded, gravity_R, configurations, out);
  }
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    const double ratio = joint.mimics() ? std::abs(joint.mimic_multiplier) : 1;
    PlantLoad& load = out[joint.mimics() ? static_cast<std::size_t>(joint.mimic_leader) : i];
    load.damping += ratio * ratio * joint.damping;
    load.friction += ratio * joint.friction;
  }
  return out;
}

double inertia_at(const Model& model, const Eigen::VectorXd& q, int joint) {
  std::vector<int> columns;
  const Eigen::MatrixXd moved = moved_by(model, columns);
  const int column = columns[static_cast<std::size_t>(joint)];
  if (column < 0) return 0;
  Data data(model);
  mass_matrix(model, data, q);
  return moved.col(column).dot(data.M * moved.col(column));
}

}  // namespace doppel
