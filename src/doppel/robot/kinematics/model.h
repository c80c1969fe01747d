#pragma once
// Model: the compiled kinematic tree of a robot; immutable, shared between threads. Data: the workspace
// of one thread. Algorithms are free functions of both (kinematics.h, dynamics.h). Joints are in
// topological order, parents first; nq and nv are never assumed equal; names are kept as written
// ("Revolute 1" has a space).

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/math/mass_properties.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline constexpr double kCriticalRestitution = 0.1353352832366127;  // exp(-2)
inline constexpr double kStiffestStop = 1e12;                       // N m/rad or N/m

struct DOPPEL_API ModelJoint {
  std::string name;
  JointType type = JointType::fixed;
  int parent_link = -1;  // index into Model::links
  int child_link = -1;
  Pose X_PJ = Pose::Identity();                     // joint frame in the parent link; the child link at q = 0
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  // unit, in the joint frame
  int q = -1, nq = 0;  // first index and count in q: 1 for revolute, continuous, prismatic; 7 floating (x y z
                       // qx qy qz qw); 3 planar (x y angle)
  int v = -1, nv = 0;  // first index and count in v: 1; 6 floating (v_WoBo in world axes, then omega in body
                       // axes); 3 planar (rates of x y angle)
  double lower = -kInfinity, upper = kInfinity;  // rad or m
  double effort = kInfinity;                     // N m or N; absent in the description: unlimited
  double velocity = kInfinity;                   // rad/s or m/s
  double damping = 0, friction = 0;              // N m s/rad or N s/m; Coulomb friction in N m or N
  // Of the stops at finite limits. Stiffness in N m/rad or N/m, 0: the engine's own stop. Restitution: speed
  // after over speed before an impact; the default is that of a critically damped spring.
  double stop_stiffness = 0, stop_restitution = kCriticalRestitution;
  int mimic_leader =
      -1;  // joint index; q = multiplier * q_leader + offset, chains resolved to the last leader
  double mimic_multiplier = 1, mimic_offset = 0;

  [[nodiscard]] bool scalar() const { return nq == 1; }  // one position, one velocity
  [[nodiscard]] bool mimics() const { return mimic_leader >= 0; }
};

struct ModelLink {
  std::string name;
  int joint = -1;  // the joint whose child this is; -1: the root
  // In the link frame, as simulated: as written, or repaired or estimated with a warning. Absent:
  // a massless frame.
  std::optional<MassProperties> inertia;
  bool weightless = false;  // <gazebo> turns gravity off for this link, as for a counterbalanced one
};

struct DOPPEL_API Model {
  std::string name;
  std::vector<ModelLink> links;    // links[0] is the root; parents before children
  std::vector<ModelJoint> joints;  // joints[i].child_link == i + 1
  int nq = 0, nv = 0;
  double total_mass = 0;  // kg

  [[nodiscard]] int find_joint(std::string_view joint_name) const;  // -1: none
  [[nodiscard]] int find_link(std::string_view link_name) const;    // -1: none
  [[nodiscard]] std::vector<std::string> link_names() const;
  [[nodiscard]] std::vector<std::string> scalar_joint_names() const;
  // The joints that can have a drive: scalar and not mimics.
  [[nodiscard]] std::vector<std::string> driven_joint_names() const;
  // q [nq] with every joint at zero, or at the nearest limit if zero is outside its limits; mimics follow;
  // floating joints at the identity.
  [[nodiscard]] Eigen::VectorXd neutral() const;
  // Sets q of every mimic joint from its leader.
  void apply_mimics(Eigen::Ref<Eigen::VectorXd> q) const;
};

// The joints between two links, parents first, fixed ones included; nullopt: `tip_link` is not below
// `base_link`. Both are indices into Model::links.
DOPPEL_API std::optional<std::vector<int>> joints_between(const Model& model, int base_link, int tip_link);

enum class BaseKind { fixed, floating };  // of the root link in the world

// Compiles a description that load_description accepted. BaseKind::floating inserts a floating joint named
// "<root>_floating" between a new link "world" and the root.
//
// Warnings, with the place: "model.no_inertial" (a movable body without mass: one is estimated),
// "model.not_physical" (mass <= 0, or a tensor that no body can have: it is repaired), "model.no_limits" and
// "model.zero_limit" (treated as unlimited), "model.negative_dynamics" (read as 0), "model.limit_stop". What
// the parser has warned of is compiled as its warning describes: a joint with a zero axis is fixed, crossed
// limits bound the same range, a <mimic> without effect (leader_of) is left out.
//
// Throws InputError: the links are not one tree ("model.not_a_tree"), or a robot with a link "world" is to
// be floating ("model.world_is_fixed").
DOPPEL_API Model compile_model(const RobotDescription& robot, BaseKind base, Diagnostics& diagnostics);

// The workspace of one thread, sized once.
struct DOPPEL_API Data {
  explicit Data(const Model& model);

  // -- forward_kinematics
  std::vector<Pose> X_WL;  // [links] link in world (the root link's frame)
  // -- inverse_dynamics
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  std::vector<Vector6> V_WL;  // [links] angular, linear; at the link's origin, in link axes; rad/s, m/s
  std::vector<Vector6> A_WL;  // [links] acceleration minus gravity, same point and axes; rad/s^2, m/s^2
  std::vector<Eigen::Vector3d> g_L;  // [links] gravity in link axes, m/s^2
  std::vector<Vector6> F_L;  // [links] torque and force on the link's subtree, same point and axes; N m, N
  Eigen::VectorXd tau;       // [nv] N m or N
  Eigen::VectorXd zero_v;    // [nv] zero velocity and acceleration of gravity_torques
  // -- inverse_dynamics and mass_matrix
  std::vector<Pose> X_PL;  // [links] link in its parent
  // -- mass_matrix
  std::vector<Eigen::Matrix<double, 6, 6>> composite;  // [links] spatial inertia of the subtree, in link axes
  Eigen::MatrixXd M;                                   // [nv, nv] kg m^2 or kg
};

}  // namespace doppel
