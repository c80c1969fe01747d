#include "doppel/conversion/mjcf.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "doppel/conversion/detail/document.h"
#include "doppel/geometry/collision.h"
#include "doppel/physics/collision_shape.h"
#include "doppel/physics/exclusions.h"
#include "doppel/physics/mjcf_convert.h"
#include "doppel/physics/servo.h"

namespace doppel {
namespace {

const Eigen::Vector3d kGravity(0, 0, -9.81);  // m/s^2

std::string quaternion_text(const Eigen::Matrix3d& R) {
  double q[4];
  quaternion_to_mujoco(Eigen::Quaterniond(R), q);
  return fmt::format("{} {} {} {}", decimal(q[0]), decimal(q[1]), decimal(q[2]), decimal(q[3]));
}

// pos and quat, left out where they say nothing.
void place(XmlNode& node, const Pose& X) {
  if (X.translation() != Eigen::Vector3d::Zero())
    node.attributes.push_back({"pos", decimals(X.translation()), {}});
  if (X.linear() != Eigen::Matrix3d::Identity())
    node.attributes.push_back({"quat", quaternion_text(X.linear()), {}});
}

void add(XmlNode& node, const char* name, std::string value) {
  node.attributes.push_back({name, std::move(value), {}});
}

std::string range_text(double lower, double upper) {
  return decimal(lower) + " " + decimal(upper);
}

XmlNode inertial_of(const MassProperties& body) {
  const PrincipalInertia principal = principal_inertia(body.I);
  return element("inertial", {{"pos", decimals(body.com)},
                              {"quat", quaternion_text(principal.axes)},
                              {"mass", decimal(body.mass)},
                              {"diaginertia", decimals(principal.moments)}});
}

class MjcfWriter {
 public:
  MjcfWriter(const RobotDescription& robot, const Model& model, MeshFiles& files, Diagnostics& diagnostics)
      : robot_(robot), model_(model), files_(files), diagnostics_(diagnostics) {
    std::vector<std::string> taken{"world"};
    for (const ModelLink& link : model.links) {
      const bool world = link.joint < 0 && link.name == "world";
      bodies_.push_back(world ? "world" : unique_name(link.name, taken));
    }
    has_shape_.assign(model.links.size(), false);
    children_.resize(model.links.size());
    for (std::size_t i = 0; i < model.joints.size(); ++i)
      children_[model.joints[i].parent_link].push_back(static_cast<int>(i));
    distribute_masses();
  }

  XmlNode write() {
    XmlNode world = element("worldbody");
    if (bodies_[0] == "world") {
      fill_body(0, world);
    } else {
      world.children.push_back(body_of(0, Pose::Identity(), -1));
    }
    XmlNode root = element("mujoco", {{"model", robot_.name}});
    root.children.push_back(element("compiler", {{"angle", "radian"}, {"inertiafromgeom", "false"}}));
    root.children.push_back(element(
        "option",
        {{"timestep", "0.001"}, {"integrator", "implicit"}, {"cone", "elliptic"}, {"impratio", "100"}}));
    root.children.push_back(defaults());
    root.children.push_back(std::move(assets_));
    root.children.push_back(std::move(world));
    root.children.push_back(exclusions());
    root.children.push_back(equalities());
    root.children.push_back(actuators());
    add_home(root);
    std::erase_if(root.children, [](const XmlNode& child) {
      return child.children.empty() && child.attributes.empty() && !child.is("worldbody");
    });
    return root;
  }

 private:
  // MuJoCo wants mass on a body that moves itself. Where only links that are fixed to it have any, the first
  // of them gives its own to it.
  void distribute_masses() {
    const std::vector<int> groups = rigid_groups(model_);
    std::vector<Pose> X_GL(model_.links.size(), Pose::Identity());
    for (const ModelLink& link : model_.links) inertias_.push_back(link.inertia);
    for (std::size_t i = 1; i < model_.links.size(); ++i) {
      const auto top = static_cast<std::size_t>(groups[i]);
      if (top == i) continue;
      const ModelJoint& joint = model_.joints[model_.links[i].joint];
      X_GL[i] = X_GL[joint.parent_link] * joint.X_PJ;
      if (top == 0 || inertias_[top] || !inertias_[i]) continue;
      inertias_[top] = transformed(*inertias_[i], X_GL[i]);
      inertias_[i].reset();
    }
  }

  static XmlNode defaults() {
    const XmlNode seen = element("geom", {{"contype", "0"}, {"conaffinity", "0"}, {"group", "2"}});
    const XmlNode felt = element("geom", {{"group", "3"}});
    // Twice the step is the stiffest that MuJoCo's constraints stay stable with.
    const XmlNode tight = element("equality", {{"solref", "0.002 1"}, {"solimp", "0.9999 0.9999 0.001"}});
    return element("default", {},
                   {tight, element("default", {{"class", "visual"}}, {seen}),
                    element("default", {{"class", "collision"}}, {felt})});
  }

  XmlNode body_of(int link, const Pose& X_PL, int joint) {
    XmlNode body = element("body", {{"name", bodies_[link]}});
    place(body, X_PL);
    if (joint >= 0) write_joint(joint, body);
    if (inertias_[link]) body.children.push_back(inertial_of(*inertias_[link]));
    fill_body(link, body);
    return body;
  }

  void fill_body(int link, XmlNode& body) {
    write_shapes(link, body);
    for (const int child : children_[link]) {
      const ModelJoint& joint = model_.joints[child];
      body.children.push_back(body_of(joint.child_link, joint.X_PJ, child));
    }
  }

  void write_joint(int index, XmlNode& body) {
    const ModelJoint& joint = model_.joints[index];
    switch (joint.type) {
      case JointType::fixed:
        return;
      case JointType::revolute:
      case JointType::continuous:
        body.children.push_back(dof(joint.name, "hinge", joint.axis, joint));
        return;
      case JointType::prismatic:
        body.children.push_back(dof(joint.name, "slide", joint.axis, joint));
        return;
      case JointType::planar: {
        const Eigen::Matrix<double, 3, 2> directions = planar_directions(joint.axis);
        body.children.push_back(dof(joint.name + "_x", "slide", directions.col(0), joint));
        body.children.push_back(dof(joint.name + "_y", "slide", directions.col(1), joint));
        body.children.push_back(dof(joint.name + "_angle", "hinge", joint.axis, joint));
        return;
      }
      case JointType::floating:
        if (bodies_[joint.parent_link] == "world") {
          body.children.push_back(element("freejoint", {{"name", joint.name}}));
          return;
        }
        for (int axis = 0; axis < 3; ++axis) {
          body.children.push_back(element("joint", {{"name", joint.name + "_" + "xyz"[axis]},
                                                    {"type", "slide"},
                                                    {"axis", decimals(Eigen::Vector3d::Unit(axis))}}));
        }
        body.children.push_back(element("joint", {{"name", joint.name + "_turn"}, {"type", "ball"}}));
        return;
    }
  }

  static XmlNode dof(const std::string& name, const char* type, const Eigen::Vector3d& axis,
                     const ModelJoint& joint) {
    XmlNode node = element("joint", {{"name", name}, {"type", type}, {"axis", decimals(axis)}});
    if (std::isfinite(joint.lower) && std::isfinite(joint.upper)) {
      add(node, "limited", "true");
      // MuJoCo refuses an empty range; a joint that is held in one place has a very small one.
      add(node, "range", range_text(joint.lower, std::max(joint.upper, joint.lower + 1e-6)));
    }
    if (joint.damping != 0) add(node, "damping", decimal(joint.damping));
    if (joint.friction != 0) add(node, "frictionloss", decimal(joint.friction));
    return node;
  }

  void write_shapes(int index, XmlNode& body) {
    const Link* link = robot_.find_link(model_.links[index].name);
    if (link == nullptr) return;  // the world that a floating base was given
    for (const Visual& visual : link->visuals) {
      auto geom = geom_of(*link, visual.geometry, visual.origin.pose(), visual.source, "visual");
      if (!geom) continue;
      if (visual.material && visual.material->rgba) {
        const Eigen::Vector4d& c = *visual.material->rgba;
        add(*geom, "rgba", decimals(c.head<3>()) + " " + decimal(c.w()));
      }
      body.children.push_back(std::move(*geom));
    }
    for (const Collision& collision : link->collisions) {
      auto geom = geom_of(*link, collision.geometry, collision.origin.pose(), collision.source, "collision");
      if (!geom) continue;
      for (const GazeboExtension& extension : robot_.gazebo) {
        if (extension.reference == link->name && extension.mu1)
          add(*geom, "friction", decimal(*extension.mu1) + " 0.005 0.0001");
      }
      has_shape_[index] = true;
      body.children.push_back(std::move(*geom));
    }
  }

  std::optional<XmlNode> geom_of(const Link& link, const Geometry& geometry, const Pose& X,
                                 const SourceLocation& where, const char* use) {
    XmlNode geom = element("geom", {{"class", use}});
    Pose X_shape = X;
    if (!has_extent(geometry)) {
      diagnostics_.warning(
          "mjcf.shape", where,
          fmt::format("a {} shape of link '{}' has no size or no file and is left out", use, link.name));
      return std::nullopt;
    }
    const auto shape = [&geom](const char* type, std::string size) {
      add(geom, "type", type);
      add(geom, "size", std::move(size));
    };
    if (const auto* box = std::get_if<Box>(&geometry)) {
      shape("box", decimals(0.5 * box->size));
    } else if (const auto* c = std::get_if<Cylinder>(&geometry)) {
      shape("cylinder", range_text(c->radius, 0.5 * c->length));
    } else if (const auto* k = std::get_if<Capsule>(&geometry)) {
      shape("capsule", range_text(k->radius, 0.5 * k->length));
    } else if (const auto* s = std::get_if<Sphere>(&geometry)) {
      shape("sphere", decimal(s->radius));
    } else if (!mesh_shape(link, std::get<MeshGeometry>(geometry), where, geom, X_shape)) {
      return std::nullopt;
    }
    place(geom, X_shape);
    return geom;
  }

  // A mesh, or a box where it is flat, which MuJoCo refuses.
  bool mesh_shape(const Link& link, const MeshGeometry& mesh, const SourceLocation& where, XmlNode& geom,
                  Pose& X) {
    const CollisionMesh* solid = nullptr;
    try {
      solid = solids_.find(mesh, fmt::format("link '{}'", link.name), where, diagnostics_);
    } catch (const InputError& error) {
      for (Diagnostic diagnostic : error.diagnostics()) {
        diagnostic.severity = Severity::warning;
        diagnostics_.add(std::move(diagnostic));
      }
    }
    if (solid == nullptr) return false;
    if (solid->hull == nullptr) {
      X = X * solid->X_GB;
      add(geom, "type", "box");
      add(geom, "size", decimals(0.5 * solid->box_size));
      return true;
    }
    add(geom, "type", "mesh");
    add(geom, "mesh", asset_of(mesh));
    return true;
  }

  std::string asset_of(const MeshGeometry& mesh) {
    const std::string file = files_.reference(mesh, {"stl", "obj"});
    const std::string scale = decimals(mesh.scale);
    const auto [found, fresh] = asset_names_.try_emplace({file, scale});
    if (fresh) {
      found->second = unique_name(std::filesystem::path(file).stem().string(), taken_assets_);
      XmlNode asset = element("mesh", {{"name", found->second}, {"file", file}});
      if (mesh.scale != Eigen::Vector3d::Ones()) add(asset, "scale", scale);
      assets_.children.push_back(std::move(asset));
    }
    return found->second;
  }

  // Neighbours, and what overlaps where the robot starts, which would be thrown apart: as `doppel up` does.
  XmlNode exclusions() {
    const std::set<std::pair<int, int>> touching = touching_at_start();
    XmlNode contact = element("contact");
    for (const LinkPair& pair : link_pairs(model_, has_shape_)) {
      if (pair.reason.empty() && !touching.contains({pair.a, pair.b})) continue;
      contact.children.push_back(
          element("exclude", {{"body1", bodies_[pair.a]}, {"body2", bodies_[pair.b]}}));
    }
    return contact;
  }

  [[nodiscard]] std::set<std::pair<int, int>> touching_at_start() const {
    Data data(model_);
    forward_kinematics(model_, data, model_.neutral());
    std::vector<int> in_model;
    std::vector<Pose> X_WL;
    for (const Link& link : robot_.links) {
      in_model.push_back(model_.find_link(link.name));
      X_WL.push_back(data.X_WL[in_model.back()]);
    }
    std::set<std::pair<int, int>> out;
    for (const LinkContact& contact : LinkCollider(robot_, CollisionDetail::hulls).contacts(X_WL))
      out.insert(std::minmax(in_model[contact.link_a], in_model[contact.link_b]));
    return out;
  }

  XmlNode equalities() {
    XmlNode out = element("equality");
    for (const ModelJoint& joint : model_.joints) {
      if (!joint.scalar() || !joint.mimics()) continue;
      out.children.push_back(element(
          "joint", {{"joint1", joint.name},
                    {"joint2", model_.joints[joint.mimic_leader].name},
                    {"polycoef", range_text(joint.mimic_offset, joint.mimic_multiplier) + " 0 0 0"}}));
    }
    return out;
  }

  // stiffness (ctrl - q) - damping v, clipped at the effort: <position> with its damping, which this version
  // of MuJoCo spells as <general>.
  XmlNode actuators() {
    XmlNode out = element("actuator");
    const std::vector<ServoParameters> servos = choose_servos(model_, ServoOptions{}, kGravity);
    for (std::size_t i = 0; i < model_.joints.size(); ++i) {
      const ModelJoint& joint = model_.joints[i];
      if (!joint.scalar() || joint.mimics()) continue;
      const ServoParameters& servo = servos[i];
      XmlNode node =
          element("general",
                  {{"name", joint.name},
                   {"joint", joint.name},
                   {"biastype", "affine"},
                   {"gainprm", decimal(servo.stiffness)},
                   {"biasprm", fmt::format("0 {} {}", decimal(-servo.stiffness), decimal(-servo.damping))}});
      if (std::isfinite(joint.lower) && std::isfinite(joint.upper) && joint.lower < joint.upper) {
        add(node, "ctrllimited", "true");
        add(node, "ctrlrange", range_text(joint.lower, joint.upper));
      }
      if (std::isfinite(joint.effort) && joint.effort > 0) {
        add(node, "forcelimited", "true");
        add(node, "forcerange", range_text(-joint.effort, joint.effort));
      }
      out.children.push_back(std::move(node));
    }
    return out;
  }

  // Where zero is outside of some joint's limits, MuJoCo's own start would be too.
  void add_home(XmlNode& root) const {
    const Eigen::VectorXd q = model_.neutral();
    const bool plain = std::all_of(model_.joints.begin(), model_.joints.end(),
                                   [](const ModelJoint& joint) { return joint.nq <= 1; });
    if (!plain || q.isZero()) return;
    std::string qpos, ctrl;
    for (const ModelJoint& joint : model_.joints) {
      if (!joint.scalar()) continue;
      qpos += (qpos.empty() ? "" : " ") + decimal(q[joint.q]);
      if (!joint.mimics()) ctrl += (ctrl.empty() ? "" : " ") + decimal(q[joint.q]);
    }
    root.children.push_back(
        element("keyframe", {}, {element("key", {{"name", "home"}, {"qpos", qpos}, {"ctrl", ctrl}})}));
  }

  const RobotDescription& robot_;
  const Model& model_;
  MeshFiles& files_;
  Diagnostics& diagnostics_;
  CollisionMeshes solids_;
  XmlNode assets_ = element("asset");
  std::map<std::pair<std::string, std::string>, std::string> asset_names_;  // by file and scale
  std::vector<std::string> taken_assets_, bodies_;
  std::vector<std::optional<MassProperties>> inertias_;  // [links]
  std::vector<std::vector<int>> children_;               // joints below each link
  std::vector<bool> has_shape_;                          // [links]
};

}  // namespace

std::string to_mjcf(const RobotDescription& robot, const Model& model, MeshFiles& meshes,
                    Diagnostics& diagnostics) {
  return to_xml(MjcfWriter(robot, model, meshes, diagnostics).write());
}

}  // namespace doppel
