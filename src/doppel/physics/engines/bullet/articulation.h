#pragma once
// A model in the form of Bullet's articulated bodies: links that fixed joints join are one rigid group,
// every group has its frame at its centre of mass along its principal axes, and every floating joint begins
// a separate tree.

#include <vector>

#include "doppel/robot/kinematics/model.h"

namespace doppel {

// A set of links that fixed joints join.
struct RigidGroup {
  int tree = -1;                 // of Articulation::trees; -1: fixed to the root
  int body = -1;                 // index of the btMultiBody's link; -1: its base
  Pose X_TB = Pose::Identity();  // frame of the body (principal axes at the centre of mass) in the top link
  double mass = 0;               // kg
  Eigen::Vector3d moments = Eigen::Vector3d::Zero();  // kg m^2, about the axes of B
  double weighing = 0;                                // kg: the part of the mass on which gravity acts
  Eigen::Vector3d p_BoG = Eigen::Vector3d::Zero();    // m: centre of mass of that part
};

enum class Axis { turn, slide };

// One link of a btMultiBody: one degree of freedom.
struct TreeLink {
  Axis kind = Axis::turn;
  int parent = -1;                                  // -1: the base
  int group = -1;                                   // -1: a massless link between the parts of a planar joint
  int q = -1, v = -1;                               // of the model
  Pose X_PB = Pose::Identity();                     // this body in its parent's, at q = 0
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  // in B
  Eigen::Vector3d p_PoJ =
      Eigen::Vector3d::Zero();  // from the parent's centre of mass to the joint, in the parent
  Eigen::Vector3d p_JoB = Eigen::Vector3d::Zero();  // from the joint to this centre of mass, in B
};

struct Tree {
  int floating_joint = -1;  // of the model; -1: the base is fixed to the root
  int base_group = -1;
  std::vector<TreeLink> links;
  [[nodiscard]] int size() const { return 6 + static_cast<int>(links.size()); }  // of its velocity
};

struct ArticulationPlace {
  int tree = -1, index = -1;  // index in the tree's velocity: 3 angular, 3 linear of the base, then the links
};

struct Articulation {
  std::vector<RigidGroup> groups;  // [0]: what is fixed to the root
  std::vector<int> group_of_link;  // [links]
  std::vector<Pose> X_BL;          // [links] in the frame of its group's body
  std::vector<Tree> trees;
  std::vector<ArticulationPlace> places;  // [nv] of the degrees of freedom of scalar and planar joints
};

// Throws InputError ("physics.deep_floating"): a floating joint below a joint that moves.
Articulation make_articulation(const Model& model);

}  // namespace doppel
