#include "doppel/review/conversion/sdf.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "doppel/base/core/unique_name.h"
#include "doppel/base/math/decimals.h"
#include "doppel/base/xml/element.h"
#include "doppel/review/conversion/detail/sdf_gazebo.h"
#include "doppel/review/conversion/detail/sdf_surface.h"
#include "doppel/robot/kinematics/link_inertia.h"

namespace doppel {
namespace {

constexpr double kSmallMass = 1e-3;     // kg, of a link with a shape and no mass
constexpr double kSmallInertia = 1e-6;  // kg m^2

std::string pose_text(const Pose& X) {
  return decimals(X.translation()) + " " + decimals(rpy_from_rotation(X.linear()));
}

std::string pose_text(const Origin& origin) {
  return decimals(origin.xyz) + " " + decimals(origin.rpy);
}

XmlNode number_element(const char* name, double value) {
  return text_element(name, decimal(value));
}

XmlNode inertial_of(const MassProperties& body) {
  XmlNode inertia = element("inertia");
  const std::pair<const char*, double> entries[] = {{"ixx", body.I(0, 0)}, {"ixy", body.I(0, 1)},
                                                    {"ixz", body.I(0, 2)}, {"iyy", body.I(1, 1)},
                                                    {"iyz", body.I(1, 2)}, {"izz", body.I(2, 2)}};
  for (const auto& [name, value] : entries) inertia.children.push_back(number_element(name, value));
  return element("inertial", {},
                 {text_element("pose", decimals(body.com) + " 0 0 0"), number_element("mass", body.mass),
                  std::move(inertia)});
}

XmlNode geometry_of(const Geometry& geometry, MeshFiles& meshes) {
  XmlNode shape;
  if (const auto* box = std::get_if<Box>(&geometry)) {
    shape = element("box", {}, {text_element("size", decimals(box->size))});
  } else if (const auto* c = std::get_if<Cylinder>(&geometry)) {
    shape =
        element("cylinder", {}, {number_element("radius", c->radius), number_element("length", c->length)});
  } else if (const auto* k = std::get_if<Capsule>(&geometry)) {
    shape =
        element("capsule", {}, {number_element("radius", k->radius), number_element("length", k->length)});
  } else if (const auto* s = std::get_if<Sphere>(&geometry)) {
    shape = element("sphere", {}, {number_element("radius", s->radius)});
  } else if (const auto* e = std::get_if<Ellipsoid>(&geometry)) {
    shape = element("ellipsoid", {}, {text_element("radii", decimals(e->radii))});
  } else if (const auto* o = std::get_if<Cone>(&geometry)) {
    shape = element("cone", {}, {number_element("radius", o->radius), number_element("length", o->length)});
  } else if (const auto* p = std::get_if<Plane>(&geometry)) {
    shape = element("plane", {},
                    {text_element("normal", decimals(p->normal)),
                     text_element("size", decimal(p->size.x()) + " " + decimal(p->size.y()))});
  } else if (const auto* x = std::get_if<Extrusion>(&geometry)) {
    shape = element("polyline");
    for (const Eigen::Vector2d& corner : x->outline)
      shape.children.push_back(text_element("point", decimal(corner.x()) + " " + decimal(corner.y())));
    shape.children.push_back(number_element("height", x->height));
  } else if (const auto* h = std::get_if<Heightmap>(&geometry)) {
    shape = sdf_heightmap(*h, meshes);
  } else {
    const auto& mesh = std::get<MeshGeometry>(geometry);
    shape = element("mesh", {}, {text_element("uri", meshes.reference(mesh))});
    if (mesh.scale != Eigen::Vector3d::Ones())
      shape.children.push_back(text_element("scale", decimals(mesh.scale)));
    if (!mesh.submesh.empty()) {
      shape.children.push_back(
          element("submesh", {},
                  {text_element("name", mesh.submesh), text_element("center", truth(mesh.center_submesh))}));
    }
  }
  return element("geometry", {}, {std::move(shape)});
}

class SdfWriter {
 public:
  SdfWriter(const RobotDescription& robot, const Model& model, MeshFiles& meshes, Diagnostics& diagnostics)
      : robot_(robot), model_(model), meshes_(meshes), diagnostics_(diagnostics) {
    for (const ModelLink& link : model.links) {
      const Link* written = robot.find_link(link.name);
      const bool bare = (written == nullptr || (written->visuals.empty() && written->collisions.empty())) &&
                        !carries_sensor(robot, link.name);
      const bool fixed = link.joint < 0 || model.joints[link.joint].type == JointType::fixed;
      is_world_.push_back(link.joint < 0 && link.name == "world");
      is_frame_.push_back(!is_world_.back() && bare && fixed && !link.inertia);
      taken_.push_back(link.name);
    }
    // A model of only frames has no link that they could be attached to.
    if (std::all_of(is_frame_.begin(), is_frame_.end(), [](bool frame) { return frame; }))
      is_frame_[0] = false;
  }

  XmlNode write() {
    name_joints();
    XmlNode model = element("model", {{"name", robot_.name}});
    for (std::size_t i = 0; i < model_.links.size(); ++i) write_link(static_cast<int>(i), model.children);
    for (std::size_t i = 0; i < model_.joints.size(); ++i) write_joint(static_cast<int>(i), model.children);
    write_gazebo_of_robot(robot_, model.children);
    return element("sdf", {{"version", "1.11"}}, {std::move(model)});
  }

 private:
  void name_joints() {
    for (const ModelJoint& joint : model_.joints) {
      const std::string name = unique_name(joint.name, taken_);
      if (name != joint.name) {
        diagnostics_.warning(
            "sdf.renamed", written(joint).source,
            fmt::format("joint '{}' has the name of a link; in SDF it is renamed to '{}'", joint.name, name),
            "give the joint a name of its own");
      }
      joint_names_.push_back(name);
    }
  }

  [[nodiscard]] const Joint& written(const ModelJoint& joint) const { return *robot_.find_joint(joint.name); }

  // The frame that elements of `link` are placed relative to.
  [[nodiscard]] std::string frame_of(int link) const {
    return is_world_[link] ? "__model__" : model_.links[link].name;
  }

  void write_link(int index, std::vector<XmlNode>& out) {
    if (is_world_[index]) {
      const Link* link = robot_.find_link("world");
      if (link != nullptr && !(link->visuals.empty() && link->collisions.empty())) {
        diagnostics_.warning("sdf.dropped", link->source,
                             "the shapes of link 'world' are omitted: in SDF the world is not a link",
                             "put them on a link that is fixed to 'world'");
      }
      return;
    }
    if (is_frame_[index]) return write_frame(index, out);
    const ModelLink& link = model_.links[index];
    const Link& source = *robot_.find_link(link.name);
    XmlNode node = element("link", {{"name", link.name}});
    if (link.joint >= 0 && has_joint(link.joint)) {
      node.children.push_back(
          text_element("pose", "0 0 0 0 0 0", {{"relative_to", joint_names_[link.joint]}}));
    } else if (index == root_holder_) {
      node.children.push_back(text_element("pose", pose_text(model_.joints[link.joint].X_PJ)));
    } else if (link.joint >= 0) {
      const ModelJoint& joint = model_.joints[link.joint];
      node.children.push_back(
          text_element("pose", pose_text(joint.X_PJ), {{"relative_to", frame_of(joint.parent_link)}}));
    }
    node.children.push_back(inertial_of(link.inertia ? *link.inertia : small_mass(source)));
    write_shapes(source, node.children);
    write_gazebo_of_link(robot_, link.name, node, diagnostics_);
    out.push_back(std::move(node));
  }

  MassProperties small_mass(const Link& link) {
    diagnostics_.warning(
        "sdf.no_mass", link.source,
        fmt::format("link '{}' has a shape or a sensor but no mass, which SDF requires; 1 g is written",
                    link.name),
        "write its <inertial>");
    return {kSmallMass, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity() * kSmallInertia};
  }

  // <frame>, by the joint's name and by the link's, as sdformat's own reader of URDF does.
  void write_frame(int index, std::vector<XmlNode>& out) {
    const ModelLink& link = model_.links[index];
    if (link.joint < 0) return write_root_frame(out);
    const ModelJoint& joint = model_.joints[link.joint];
    out.push_back(element("frame",
                          {{"name", joint_names_[link.joint]}, {"attached_to", frame_of(joint.parent_link)}},
                          {text_element("pose", pose_text(written(joint).origin))}));
    out.push_back(element("frame", {{"name", link.name}, {"attached_to", joint_names_[link.joint]}}));
  }

  // A root without mass (base_footprint) is attached to the first link that is fixed to it.
  void write_root_frame(std::vector<XmlNode>& out) {
    for (const ModelJoint& joint : model_.joints) {
      if (joint.parent_link != 0 || is_frame_[joint.child_link]) continue;
      if (joint.type != JointType::fixed) continue;
      root_holder_ = joint.child_link;
      out.push_back(
          element("frame", {{"name", model_.links[0].name}, {"attached_to", model_.links[root_holder_].name}},
                  {text_element("pose", pose_text(joint.X_PJ.inverse()))}));
      return;
    }
    out.push_back(element("frame", {{"name", model_.links[0].name}}));
  }

  [[nodiscard]] bool has_joint(int index) const {
    const ModelJoint& joint = model_.joints[index];
    return joint.type != JointType::planar && joint.type != JointType::floating &&
           joint.child_link != root_holder_;
  }

  void write_shapes(const Link& link, std::vector<XmlNode>& out) {
    std::vector<std::string> names;
    for (const Visual& visual : link.visuals) {
      const std::string name = unique_name(visual.name.empty() ? link.name + "_visual" : visual.name, names);
      XmlNode node = element("visual", {{"name", name}});
      node.children = {text_element("pose", pose_text(visual.origin)), geometry_of(visual.geometry, meshes_)};
      if (visual.material) {
        if (auto material = sdf_material(*visual.material, meshes_))
          node.children.push_back(std::move(*material));
      }
      out.push_back(std::move(node));
    }
    names.clear();
    for (const Collision& collision : link.collisions) {
      const std::string name =
          unique_name(collision.name.empty() ? link.name + "_collision" : collision.name, names);
      XmlNode node = element("collision", {{"name", name}});
      node.children = {text_element("pose", pose_text(collision.origin)),
                       geometry_of(collision.geometry, meshes_)};
      if (auto surface = sdf_surface(collision.surface)) node.children.push_back(std::move(*surface));
      out.push_back(std::move(node));
    }
  }

  void write_joint(int index, std::vector<XmlNode>& out) {
    const ModelJoint& joint = model_.joints[index];
    if (is_frame_[joint.child_link] || joint.child_link == root_holder_) return;
    if (!has_joint(index)) {
      diagnostics_.warning(
          "sdf.joint_type", written(joint).source,
          fmt::format("SDF has no counterpart of the {} joint '{}'; link '{}' is not connected",
                      joint.type == JointType::planar ? "planar" : "floating", joint.name,
                      model_.links[joint.child_link].name));
      return;
    }
    XmlNode node = element("joint", {{"name", joint_names_[index]}, {"type", type_of(joint)}});
    node.children = {
        text_element("pose", pose_text(written(joint).origin),
                     {{"relative_to", frame_of(joint.parent_link)}}),
        text_element("parent", is_world_[joint.parent_link] ? "world" : model_.links[joint.parent_link].name),
        text_element("child", model_.links[joint.child_link].name)};
    if (joint.type != JointType::fixed) node.children.push_back(axis_of(joint));
    write_gazebo_of_joint(robot_, joint.name, node, diagnostics_);
    out.push_back(std::move(node));
  }

  static std::string type_of(const ModelJoint& joint) {
    if (joint.type == JointType::fixed) return "fixed";
    if (joint.type == JointType::continuous) return "continuous";
    return joint.type == JointType::prismatic ? "prismatic" : "revolute";
  }

  XmlNode axis_of(const ModelJoint& joint) {
    XmlNode axis = element("axis", {}, {text_element("xyz", decimals(joint.axis))});
    XmlNode limit = element("limit");
    if (std::isfinite(joint.lower)) limit.children.push_back(number_element("lower", joint.lower));
    if (std::isfinite(joint.upper)) limit.children.push_back(number_element("upper", joint.upper));
    if (std::isfinite(joint.effort)) limit.children.push_back(number_element("effort", joint.effort));
    if (std::isfinite(joint.velocity)) limit.children.push_back(number_element("velocity", joint.velocity));
    if (!limit.children.empty()) axis.children.push_back(std::move(limit));
    axis.children.push_back(
        element("dynamics", {},
                {number_element("damping", joint.damping), number_element("friction", joint.friction)}));
    if (joint.mimics()) {
      axis.children.push_back(
          element("mimic", {{"joint", joint_names_[joint.mimic_leader]}},
                  {number_element("multiplier", joint.mimic_multiplier),
                   number_element("offset", joint.mimic_offset), number_element("reference", 0)}));
    }
    return axis;
  }

  const RobotDescription& robot_;
  const Model& model_;
  MeshFiles& meshes_;
  Diagnostics& diagnostics_;
  std::vector<bool> is_world_, is_frame_;  // [links]
  std::vector<std::string> taken_, joint_names_;
  int root_holder_ = -1;  // the link that a root without mass is attached to
};

}  // namespace

std::string to_sdf(const RobotDescription& robot, const Model& model, MeshFiles& meshes,
                   Diagnostics& diagnostics) {
  return to_xml(SdfWriter(robot, model, meshes, diagnostics).write());
}

}  // namespace doppel
