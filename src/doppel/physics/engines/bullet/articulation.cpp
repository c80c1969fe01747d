#include "doppel/physics/engines/bullet/articulation.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {
namespace {

// Right-handed principal axes of a symmetric tensor, as columns.
Eigen::Matrix3d principal_axes(const Eigen::Matrix3d& I, Eigen::Vector3d& moments) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(I);
  moments = solver.eigenvalues();
  Eigen::Matrix3d R = solver.eigenvectors();
  if (R.determinant() < 0) R.col(2) = -R.col(2);
  return R;
}

class Builder {
 public:
  explicit Builder(const Model& model) : model_(model) {
    out_.group_of_link.assign(model.links.size(), 0);
    X_TL_.assign(model.links.size(), Pose::Identity());
    out_.places.resize(static_cast<std::size_t>(model.nv));
  }

  Articulation build() {
    out_.groups.emplace_back();
    for (const ModelJoint& joint : model_.joints) place_child(joint);
    sum_masses();
    for (const ModelJoint& joint : model_.joints) {
      if (joint.type != JointType::fixed) add_joint(joint);
    }
    for (std::size_t i = 0; i < model_.links.size(); ++i)
      out_.X_BL.push_back(group(static_cast<int>(i)).X_TB.inverse(Eigen::Isometry) * X_TL_[i]);
    return std::move(out_);
  }

 private:
  RigidGroup& group(int link) {
    return out_.groups[static_cast<std::size_t>(out_.group_of_link[static_cast<std::size_t>(link)])];
  }
  void place_child(const ModelJoint& joint) {
    const auto child = static_cast<std::size_t>(joint.child_link);
    const auto parent = static_cast<std::size_t>(joint.parent_link);
    if (joint.type == JointType::fixed) {
      out_.group_of_link[child] = out_.group_of_link[parent];
      X_TL_[child] = X_TL_[parent] * joint.X_PJ;
      return;
    }
    out_.group_of_link[child] = static_cast<int>(out_.groups.size());
    out_.groups.emplace_back();
  }
  void sum_masses() {
    std::vector<MassProperties> sums(out_.groups.size()), weighing(out_.groups.size());
    for (std::size_t i = 0; i < model_.links.size(); ++i) {
      const ModelLink& link = model_.links[i];
      if (!link.inertia) continue;
      const auto at = static_cast<std::size_t>(out_.group_of_link[i]);
      const MassProperties body = transformed(*link.inertia, X_TL_[i]);
      sums[at] = combined(sums[at], body);
      if (!link.weightless) weighing[at] = combined(weighing[at], body);
    }
    for (std::size_t i = 1; i < out_.groups.size(); ++i) {  // the root's own frame stays the link's
      RigidGroup& group = out_.groups[i];
      if (!(sums[i].mass > 0)) continue;
      group.mass = sums[i].mass;
      group.X_TB.translation() = sums[i].com;
      group.X_TB.linear() = principal_axes(sums[i].I, group.moments);
      group.weighing = weighing[i].mass;
      if (group.weighing > 0) group.p_BoG = group.X_TB.inverse(Eigen::Isometry) * weighing[i].com;
    }
  }
  Tree& tree_of(int parent_link) {
    RigidGroup& parent = group(parent_link);
    if (parent.tree < 0) {
      for (std::size_t i = 0; i < out_.trees.size(); ++i) {
        if (out_.trees[i].floating_joint < 0) return out_.trees[i];
      }
      out_.trees.push_back({-1, 0, {}});
      return out_.trees.back();
    }
    return out_.trees[static_cast<std::size_t>(parent.tree)];
  }
  void add_joint(const ModelJoint& joint) {
    RigidGroup& child = group(joint.child_link);
    if (joint.type == JointType::floating) {
      if (group(joint.parent_link).tree >= 0) {
        throw InputError(
            "physics.deep_floating", {},
            fmt::format("floating joint '{}' has the movable parent link '{}'; in Bullet, bodies float "
                        "relative to the world only",
                        joint.name, model_.links[static_cast<std::size_t>(joint.parent_link)].name),
            "choose --engine mujoco, or attach the floating link to the root");
      }
      child.tree = static_cast<int>(out_.trees.size());
      out_.trees.push_back({static_cast<int>(&joint - model_.joints.data()),
                            out_.group_of_link[static_cast<std::size_t>(joint.child_link)],
                            {}});
      return;
    }
    Tree& tree = tree_of(joint.parent_link);
    child.tree = static_cast<int>(&tree - out_.trees.data());
    if (joint.type == JointType::planar) {
      add_planar(joint, tree, child);
    } else {
      const RigidGroup& parent = group(joint.parent_link);
      const Pose X_BJ = parent.X_TB.inverse(Eigen::Isometry) *
                        X_TL_[static_cast<std::size_t>(joint.parent_link)] * joint.X_PJ;
      add_link(tree, joint.type == JointType::prismatic ? Axis::slide : Axis::turn, parent.body, X_BJ,
               joint.axis, &child, joint.q, joint.v);
    }
  }
  // Two slides without mass and a turn.
  void add_planar(const ModelJoint& joint, Tree& tree, RigidGroup& child) {
    const RigidGroup& parent = group(joint.parent_link);
    const Pose X_BJ = parent.X_TB.inverse(Eigen::Isometry) *
                      X_TL_[static_cast<std::size_t>(joint.parent_link)] * joint.X_PJ;
    const Eigen::Matrix<double, 3, 2> directions = planar_directions(joint.axis);
    add_link(tree, Axis::slide, parent.body, X_BJ, directions.col(0), nullptr, joint.q, joint.v);
    const int first = static_cast<int>(tree.links.size()) - 1;
    add_link(tree, Axis::slide, first, Pose::Identity(), directions.col(1), nullptr, joint.q + 1,
             joint.v + 1);
    add_link(tree, Axis::turn, first + 1, Pose::Identity(), joint.axis, &child, joint.q + 2, joint.v + 2);
  }
  void add_link(Tree& tree, Axis kind, int parent, const Pose& X_BJ, const Eigen::Vector3d& axis_J,
                RigidGroup* child, int q, int v) {
    const Pose X_JB = child != nullptr ? child->X_TB : Pose::Identity();
    TreeLink link;
    link.kind = kind;
    link.parent = parent;
    link.group = child != nullptr ? static_cast<int>(child - out_.groups.data()) : -1;
    link.q = q;
    link.v = v;
    link.X_PB = X_BJ * X_JB;
    link.axis = (X_JB.linear().transpose() * axis_J).normalized();
    link.p_PoJ = X_BJ.translation();
    link.p_JoB = X_JB.linear().transpose() * X_JB.translation();
    const int index = static_cast<int>(tree.links.size());
    if (child != nullptr) child->body = index;
    out_.places[static_cast<std::size_t>(v)] = {static_cast<int>(&tree - out_.trees.data()), 6 + index};
    tree.links.push_back(link);
  }

  const Model& model_;
  std::vector<Pose> X_TL_;  // [links] in its group's top link
  Articulation out_;
};

}  // namespace

Articulation make_articulation(const Model& model) {
  return Builder(model).build();
}

}  // namespace doppel
