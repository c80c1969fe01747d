#include "doppel/review/conversion/mjcf_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "doppel/base/core/unique_name.h"
#include "doppel/base/math/decimals.h"
#include "doppel/base/xml/element.h"
#include "doppel/physics/contract/described_servo.h"
#include "doppel/physics/mjcf/mjcf.h"
#include "doppel/review/conversion/detail/quantities.h"
#include "doppel/robot/collision/collision_scene.h"
#include "doppel/robot/collision/link_pairs.h"

namespace doppel {

// The constraints of the twin's own model (physics/engines/mujoco/engine_model.cpp): MuJoCo's own defaults let joints creep
// under friction and sink into their limits. A time constant of twice the step is the stiffest stable one.
XmlNode mjcf_defaults(double step) {
  const std::string hard = decimal(2 * step) + " 1", soft = decimal(5 * step) + " 1";
  const char *const holds = "0.9999 0.9999 0.001 0.5 2", *const yields = "0.95 0.99 0.001 0.5 2";
  const XmlNode seen = element("geom", {{"contype", "0"}, {"conaffinity", "0"}, {"group", "2"}});
  const XmlNode felt = element("geom", {{"group", "3"}});
  return element("default", {},
                 {element("geom", {{"solref", soft}, {"solimp", yields}}),
                  element("joint", {{"solreffriction", hard},
                                    {"solimpfriction", holds},
                                    {"solreflimit", soft},
                                    {"solimplimit", yields}}),
                  element("equality", {{"solref", hard}, {"solimp", holds}}),
                  element("default", {{"class", "visual"}}, {seen}),
                  element("default", {{"class", "collision"}}, {felt})});
}

namespace {

constexpr double kMjcfStep = 1e-3;  // s, of an exported robot

class MjcfWriter final : private MjcfNaming {
 public:
  MjcfWriter(const RobotDescription& robot, const Model& model, MeshFiles& files, Diagnostics& diagnostics)
      : robot_(robot), model_(model), files_(files), diagnostics_(diagnostics) {
    std::vector<std::string> taken{"world"};
    for (const ModelLink& link : model.links) {
      const bool world = link.joint < 0 && link.name == "world";
      bodies_.push_back(world ? "world" : unique_name(link.name, taken));
    }
    has_shape_.assign(model.links.size(), false);
    distribute_masses();
  }

  XmlNode write() {
    XmlNode world = element("worldbody");
    MjcfBodies bodies(model_, *this);
    if (bodies_[0] == "world") {
      bodies.fill_world(world);
    } else {
      world.children.push_back(bodies.tree(Pose::Identity()));
    }
    XmlNode root = element("mujoco", {{"model", robot_.name}});
    root.children.push_back(element("compiler", {{"angle", "radian"}, {"inertiafromgeom", "false"}}));
    root.children.push_back(element("option", {{"timestep", decimal(kMjcfStep)},
                                               {"integrator", "implicit"},
                                               {"cone", "elliptic"},
                                               {"impratio", "100"}}));
    root.children.push_back(mjcf_defaults(kMjcfStep));
    root.children.push_back(std::move(assets_));
    root.children.push_back(std::move(world));
    root.children.push_back(exclusions());
    root.children.push_back(element("equality", {}, mjcf_couplings(model_, *this)));
    root.children.push_back(actuators());
    add_home(root);
    std::erase_if(root.children, [](const XmlNode& child) {
      return child.children.empty() && child.attributes.empty() && !child.is("worldbody");
    });
    return root;
  }

 private:
  // MuJoCo requires a mass for every moving body. Where only links that are fixed to it have one, the mass of
  // the first of them is assigned to it.
  void distribute_masses() {
    const std::vector<int> groups = rigid_groups(model_);
    const std::vector<Pose> X_GL = poses_in_groups(model_, groups);
    for (const ModelLink& link : model_.links) inertias_.push_back(link.inertia);
    for (std::size_t i = 1; i < model_.links.size(); ++i) {
      const auto top = static_cast<std::size_t>(groups[i]);
      if (top == i) continue;
      if (top == 0 || inertias_[top] || !inertias_[i]) continue;
      inertias_[top] = transformed(*inertias_[i], X_GL[i]);
      inertias_[i].reset();
    }
  }

  [[nodiscard]] std::string body_name(int link) const override { return bodies_[link]; }
  [[nodiscard]] std::string joint_name(int joint, std::string_view part) const override {
    const std::string& name = model_.joints[joint].name;
    return part.empty() ? name : name + "_" + std::string(part);
  }
  [[nodiscard]] std::optional<MassProperties> inertia(int link) const override { return inertias_[link]; }
  [[nodiscard]] bool free_joint(int joint) const override {
    return bodies_[model_.joints[joint].parent_link] == "world";
  }
  void complete(const ModelJoint& joint, XmlNode& dof) const override {
    if (joint.damping != 0) add_attribute(dof, "damping", decimal(joint.damping));
    if (joint.friction != 0) add_attribute(dof, "frictionloss", decimal(joint.friction));
    const ServoParameters& servo = servos_[static_cast<std::size_t>(joint.child_link - 1)];
    if (servo.armature > 0) add_attribute(dof, "armature", decimal(servo.armature));
  }

  void add_shapes(int index, XmlNode& body) override {
    const Link* link = robot_.find_link(model_.links[index].name);
    if (link == nullptr) return;  // the world that was added for a floating base
    for (const Visual& visual : link->visuals) {
      auto geom = geom_of(*link, visual.geometry, visual.origin.pose(), visual.source, "visual");
      if (!geom) continue;
      if (visual.material && visual.material->rgba) {
        const Eigen::Vector4d& c = *visual.material->rgba;
        add_attribute(*geom, "rgba", decimals(c.head<3>()) + " " + decimal(c.w()));
      }
      body.children.push_back(std::move(*geom));
    }
    for (const Collision& collision : link->collisions) {
      auto geom = geom_of(*link, collision.geometry, collision.origin.pose(), collision.source, "collision");
      if (!geom) continue;
      std::optional<double> mu = collision.surface.mu;
      for (const GazeboExtension& extension : robot_.gazebo) {
        if (extension.reference == link->name && extension.surface.mu) mu = extension.surface.mu;
      }
      if (mu) add_attribute(*geom, "friction", decimal(*mu) + " 0.005 0.0001");
      has_shape_[index] = true;
      body.children.push_back(std::move(*geom));
    }
  }

  std::optional<XmlNode> geom_of(const Link& link, const Geometry& geometry, const Pose& X,
                                 const SourceLocation& where, const char* use) {
    XmlNode geom = element("geom", {{"class", use}});
    Pose X_shape = X;
    const auto* const file = std::get_if<MeshGeometry>(&geometry);
    if (!has_size(geometry) || std::holds_alternative<Plane>(geometry) ||
        (file != nullptr && file->path.empty())) {
      diagnostics_.warning(
          "mjcf.shape", where,
          fmt::format("a {} shape of link '{}' has no size or no file and is omitted", use, link.name));
      return std::nullopt;
    }
    if (file != nullptr) {
      if (!mesh_shape(link, *file, where, geom, X_shape)) return std::nullopt;
    } else if (const auto* box = std::get_if<Box>(&geometry)) {
      mjcf_size(geom, *box);
    } else if (const auto* cylinder = std::get_if<Cylinder>(&geometry)) {
      mjcf_size(geom, *cylinder);
    } else if (const auto* capsule = std::get_if<Capsule>(&geometry)) {
      mjcf_size(geom, *capsule);
    } else if (const auto* sphere = std::get_if<Sphere>(&geometry)) {
      mjcf_size(geom, *sphere);
    } else if (const auto* ellipsoid = std::get_if<Ellipsoid>(&geometry)) {
      mjcf_size(geom, *ellipsoid);
    } else {
      diagnostics_.warning(
          "mjcf.shape", where,
          fmt::format("a {} shape of link '{}' is a cone, an extrusion or a heightmap, which is not "
                      "written to MJCF",
                      use, link.name),
          "use a mesh");
      return std::nullopt;
    }
    mjcf_place(geom, X_shape);
    return geom;
  }

  // A mesh, or a box for a flat one, which MuJoCo rejects.
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
      mjcf_size(geom, Box{solid->box_size});
      return true;
    }
    add_attribute(geom, "type", "mesh");
    add_attribute(geom, "mesh", asset_of(mesh));
    return true;
  }

  std::string asset_of(const MeshGeometry& mesh) {
    const std::string file = files_.reference(mesh, {"stl", "obj"});
    const std::string scale = decimals(mesh.scale);
    const auto [found, fresh] = asset_names_.try_emplace({file, scale});
    if (fresh) {
      found->second = unique_name(std::filesystem::path(file).stem().string(), taken_assets_);
      XmlNode asset = element("mesh", {{"name", found->second}, {"file", file}});
      if (mesh.scale != Eigen::Vector3d::Ones()) add_attribute(asset, "scale", scale);
      assets_.children.push_back(std::move(asset));
    }
    return found->second;
  }

  // Neighbours, and links that overlap at the start, which would be pushed apart; as in `doppel up`.
  XmlNode exclusions() {
    CollisionContext context(
        std::make_shared<const CollisionScene>(std::vector{described_robot(robot_, model_)}));
    std::set<std::pair<int, int>> pairs;
    for (const AllowedPair& pair : context.scene().allowed_pairs()) pairs.emplace(pair.a.link, pair.b.link);
    for (const PairDistance& pair : context.contacts()) pairs.emplace(pair.a.link, pair.b.link);
    XmlNode contact = element("contact");
    for (const auto& [a, b] : pairs) {
      if (!has_shape_[a] || !has_shape_[b]) continue;
      contact.children.push_back(element("exclude", {{"body1", bodies_[a]}, {"body2", bodies_[b]}}));
    }
    return contact;
  }

  // stiffness (ctrl - q) - damping v, clipped at the effort: <position> with its damping, which this version
  // of MuJoCo writes as <general>.
  XmlNode actuators() {
    XmlNode out = element("actuator");
    for (std::size_t i = 0; i < model_.joints.size(); ++i) {
      const ModelJoint& joint = model_.joints[i];
      if (!joint.scalar() || joint.mimics()) continue;
      const ServoParameters& servo = servos_[i];
      XmlNode node =
          element("general",
                  {{"name", joint.name},
                   {"joint", joint.name},
                   {"biastype", "affine"},
                   {"gainprm", decimal(servo.stiffness)},
                   {"biasprm", fmt::format("0 {} {}", decimal(-servo.stiffness), decimal(-servo.damping))}});
      if (std::isfinite(joint.lower) && std::isfinite(joint.upper) && joint.lower < joint.upper) {
        add_attribute(node, "ctrllimited", "true");
        add_attribute(node, "ctrlrange", mjcf_range(joint.lower, joint.upper));
      }
      if (std::isfinite(joint.effort) && joint.effort > 0) {
        add_attribute(node, "forcelimited", "true");
        add_attribute(node, "forcerange", mjcf_range(-joint.effort, joint.effort));
      }
      out.children.push_back(std::move(node));
    }
    return out;
  }

  // MuJoCo's default start is zero, also where zero is outside of a joint's limits.
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
  std::vector<ServoParameters> servos_ = choose_servos(robot_, model_, ServoOptions{}, kGravity);
  MeshFiles& files_;
  Diagnostics& diagnostics_;
  CollisionMeshes solids_;
  XmlNode assets_ = element("asset");
  std::map<std::pair<std::string, std::string>, std::string> asset_names_;  // by file and scale
  std::vector<std::string> taken_assets_, bodies_;
  std::vector<std::optional<MassProperties>> inertias_;  // [links]
  std::vector<bool> has_shape_;                          // [links]
};

}  // namespace

std::string to_mjcf(const RobotDescription& robot, const Model& model, MeshFiles& meshes,
                    Diagnostics& diagnostics) {
  return to_xml(MjcfWriter(robot, model, meshes, diagnostics).write());
}

}  // namespace doppel
