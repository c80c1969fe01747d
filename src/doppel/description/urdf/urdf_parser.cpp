#include "doppel/description/urdf/urdf_parser.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "doppel/base/core/names.h"
#include "doppel/description/urdf/urdf_reader.h"
#include "doppel/description/urdf/urdf_version.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxPlaces = 8;  // searched places of a mesh in one message

class Parser {
 public:
  Parser(const std::filesystem::path& base, const PackageResolver& resolver, Diagnostics& diagnostics)
      : base_(base), resolver_(resolver), diagnostics_(diagnostics), read_(diagnostics) {}

  RobotDescription robot(const XmlNode& root);

 private:
  Link link(const XmlNode& node);
  Joint joint(const XmlNode& node);
  Origin origin(const XmlNode& parent, UrdfReader& read);
  std::optional<Eigen::Vector3d> rotation(const XmlNode& origin, UrdfReader& read);
  std::optional<Inertial> inertial(const XmlNode& node);
  std::optional<Geometry> geometry(const XmlNode& parent, UrdfReader& read);
  Geometry mesh(const XmlNode& node, UrdfReader& read);
  void visual(const XmlNode& node, Link& out);
  void collision(const XmlNode& node, Link& out);
  std::optional<Material> material(const XmlNode& node);
  std::optional<JointLimits> limits(const XmlNode& node, const Joint& joint);
  std::optional<double> rate_limit(const XmlNode& limit, const char* name);
  JointType joint_type(const XmlNode& node);
  void joint_details(const XmlNode& node, Joint& out);
  void hardware(const XmlNode& node, RobotDescription& out);
  void look_up_materials(RobotDescription& robot);

  std::filesystem::path base_;
  const PackageResolver& resolver_;
  Diagnostics& diagnostics_;
  UrdfReader read_;
  UrdfVersion version_;
  NewerElements newer_;
};

// A file of version 1.1 has rpy or quat_xyzw, not both, as in urdfdom; before, only rpy counts beside the
// other.
std::optional<Eigen::Vector3d> Parser::rotation(const XmlNode& origin, UrdfReader& read) {
  const XmlAttribute* quaternion = origin.find("quat_xyzw");
  const bool has_rpy = origin.find("rpy") != nullptr;
  if (quaternion == nullptr) return read.vector<3>(origin, "rpy");
  if (has_rpy && version_ < kUrdf11) {
    diagnostics_.warning("urdf.version", quaternion->where,
                         "quat_xyzw beside rpy is ignored, because the file is of version 1.0",
                         "remove one of the two");
    return read.vector<3>(origin, "rpy");
  }
  newer_.uses("quat_xyzw of <origin>", kUrdf11, quaternion->where);
  if (has_rpy) {
    read.fault("urdf.two_rotations", quaternion->where, "<origin> has both rpy and quat_xyzw",
               "remove one of the two");
    return std::nullopt;
  }
  const auto rpy = rpy_of_quaternion(quaternion->value);
  // In a file of version 1.0 it has no effect in ROS 2, so that it stops nothing here either.
  UrdfReader optional(diagnostics_, "urdf.optional_value", "the rotation is treated as none");
  if (!rpy) {
    (version_ < kUrdf11 ? optional : read)
        .fault("urdf.vector", quaternion->where,
               fmt::format("quat_xyzw=\"{}\" of <origin> is not four finite numbers with a length above 0",
                           quaternion->value),
               "write x y z w with decimal points, separated by spaces, such as 0 0 0 1");
  }
  return rpy;
}

Origin Parser::origin(const XmlNode& parent, UrdfReader& read) {
  Origin out;
  const XmlNode* node = parent.first("origin");
  if (node == nullptr) return out;
  out.source = node->where;
  if (const auto xyz = read.vector<3>(*node, "xyz")) out.xyz = *xyz;
  if (const auto rpy = rotation(*node, read)) out.rpy = *rpy;
  return out;
}

// As in urdfdom, an <inertial> that cannot be read leaves the link without one, except for a mass without a
// tensor: the mass is used.
std::optional<Inertial> Parser::inertial(const XmlNode& node) {
  UrdfReader read(diagnostics_, "urdf.inertial", "the link is treated as without <inertial>");
  Inertial out;
  out.source = node.where;
  out.origin = origin(node, read);
  const XmlNode* mass = node.first("mass");
  const XmlNode* inertia = node.first("inertia");
  if (mass != nullptr) {
    read.required(*mass, "value");
    out.mass = read.number_or(*mass, "value", 0.0);
  }
  out.tensor_written = inertia != nullptr;
  if (out.mass > 0 && inertia == nullptr && !read.faulty()) {
    diagnostics_.warning("urdf.inertial", node.where,
                         "<inertial> has no <inertia>; the mass is kept, and the inertia tensor is computed "
                         "from the link's shapes, or from a sphere without any; urdfdom drops the <inertial>",
                         "write <inertia> with the inertia tensor about the centre of mass");
    return out;
  }
  if (mass == nullptr || inertia == nullptr) {
    read.fault("urdf.inertial", node.where,
               fmt::format("<inertial> has no <{}>", mass == nullptr ? "mass" : "inertia"),
               "write both, or remove the <inertial>");
    return std::nullopt;
  }
  const std::pair<const char*, double*> entries[] = {{"ixx", &out.ixx}, {"ixy", &out.ixy}, {"ixz", &out.ixz},
                                                     {"iyy", &out.iyy}, {"iyz", &out.iyz}, {"izz", &out.izz}};
  for (const auto& [name, value] : entries) *value = read.number_or(*inertia, name, 0.0);
  for (const char* name : {"ixx", "iyy", "izz"}) read.required(*inertia, name);
  if (read.faulty()) return std::nullopt;
  return out;
}

Geometry Parser::mesh(const XmlNode& node, UrdfReader& read) {
  MeshGeometry out;
  out.uri = read.required(node, "filename");
  if (const auto scale = read.vector<3>(node, "scale")) out.scale = *scale;
  if (read.faulty()) return out;
  const PackageResolver::Resolved found = resolver_.resolve(out.uri, base_);
  std::error_code none;
  const bool is_file = !found.path.empty() && !std::filesystem::is_directory(found.path, none);
  if (!is_file) {
    std::string tried;
    for (std::size_t i = 0; i < found.tried.size() && i < kMaxPlaces; ++i) tried += "\n    " + found.tried[i];
    if (found.tried.size() > kMaxPlaces)
      tried += fmt::format("\n    and {} more", found.tried.size() - kMaxPlaces);
    diagnostics_.warning(
        "mesh.missing", node.where,
        fmt::format("the mesh '{}' is not found; a marked box replaces it. Tried:{}", out.uri, tried),
        found.nearest.empty() ? "correct the name, or add the file"
                              : fmt::format("did you mean '{}'?", found.nearest));
  }
  if (is_file) out.path = found.path.string();
  return out;
}

// A negative size is treated as a wrong sign: its absolute value is used.
double size_of(const XmlNode& shape, const char* name, UrdfReader& read, Diagnostics& diagnostics) {
  read.required(shape, name);
  const double value = read.number_or(shape, name, 1.0);
  if (value < 0) {
    diagnostics.warning(
        "urdf.geometry", shape.where,
        fmt::format("the {} of <{}> is negative: {}; its absolute value is used", name, shape.name, value));
  }
  return std::abs(value);
}

Box read_box(const XmlNode& shape, UrdfReader& read, Diagnostics& diagnostics) {
  read.required(shape, "size");
  const Eigen::Vector3d size = read.vector<3>(shape, "size").value_or(Eigen::Vector3d::Ones());
  if ((size.array() < 0).any()) {
    diagnostics.warning(
        "urdf.geometry", shape.where,
        fmt::format("the size of <box> is negative: {:g} {:g} {:g}; its absolute value is used", size.x(),
                    size.y(), size.z()),
        fmt::format("write size=\"{:g} {:g} {:g}\"", std::abs(size.x()), std::abs(size.y()),
                    std::abs(size.z())));
  }
  return {size.cwiseAbs()};
}

// Of several shapes in a <geometry> the first is used, as in urdfdom.
std::optional<Geometry> Parser::geometry(const XmlNode& parent, UrdfReader& read) {
  const XmlNode* node = parent.first("geometry");
  const XmlNode* shape = nullptr;
  if (node != nullptr) {
    const auto found = std::find_if(node->children.begin(), node->children.end(),
                                    [](const XmlNode& n) { return n.kind == XmlNode::Kind::element; });
    if (found != node->children.end()) shape = &*found;
  }
  if (shape == nullptr) {
    read.fault("urdf.geometry", parent.where,
               fmt::format("<{}> has no <geometry> with a shape", parent.name));
    return std::nullopt;
  }
  const auto size = [&](const char* name) { return size_of(*shape, name, read, diagnostics_); };
  if (shape->name == "box") return read_box(*shape, read, diagnostics_);
  if (shape->name == "cylinder") return Cylinder{size("radius"), size("length")};
  if (shape->name == "capsule") newer_.uses("<capsule>", kUrdf11, shape->where);
  if (shape->name == "capsule") return Capsule{size("radius"), size("length")};
  if (shape->name == "sphere") return Sphere{size("radius")};
  if (shape->name == "mesh") return mesh(*shape, read);
  const std::vector<std::string> shapes{"box", "cylinder", "capsule", "sphere", "mesh"};
  read.fault("urdf.geometry", shape->where,
             fmt::format("<{}> is not a shape{}", shape->name, did_you_mean(shape->name, shapes)));
  return std::nullopt;
}

std::optional<Material> Parser::material(const XmlNode& node) {
  Material out;
  out.name = UrdfReader::optional(node, "name");
  out.source = node.where;
  UrdfReader read(diagnostics_, "urdf.optional_value", "the material is treated as without a colour");
  if (const XmlNode* color = node.first("color")) out.rgba = read.vector<4>(*color, "rgba");
  if (const XmlNode* texture = node.first("texture"))
    out.texture = UrdfReader::optional(*texture, "filename");
  return out;
}

void Parser::visual(const XmlNode& node, Link& out) {
  UrdfReader read(diagnostics_, "urdf.geometry", "this <visual> is ignored");
  Visual visual{UrdfReader::optional(node, "name"), origin(node, read), {}, {}, node.where};
  const auto shape = geometry(node, read);
  if (!shape || read.faulty()) return;
  if (const XmlNode* named = node.first("material")) visual.material = material(*named);
  visual.geometry = *shape;
  out.visuals.push_back(std::move(visual));
}

void Parser::collision(const XmlNode& node, Link& out) {
  UrdfReader read(diagnostics_, "urdf.geometry", "this <collision> is ignored");
  Collision collision{UrdfReader::optional(node, "name"), origin(node, read), {}, node.where};
  const auto shape = geometry(node, read);
  if (!shape || read.faulty()) return;
  collision.geometry = *shape;
  out.collisions.push_back(std::move(collision));
}

Link Parser::link(const XmlNode& node) {
  Link out;
  out.name = read_.required(node, "name");
  out.source = node.where;
  for (const XmlNode& child : node.children) {
    if (child.is("inertial")) out.inertial = inertial(child);
    if (child.is("visual")) visual(child, out);
    if (child.is("collision")) collision(child, out);
  }
  return out;
}

JointType Parser::joint_type(const XmlNode& node) {
  const std::map<std::string, JointType> types{
      {"fixed", JointType::fixed},           {"revolute", JointType::revolute},
      {"continuous", JointType::continuous}, {"prismatic", JointType::prismatic},
      {"floating", JointType::floating},     {"planar", JointType::planar}};
  const std::string type = read_.required(node, "type");
  if (const auto found = types.find(type); found != types.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [name, value] : types) names.push_back(name);
  if (!type.empty()) {
    diagnostics_.error("urdf.joint_type", node.find("type")->where,
                       fmt::format("'{}' is not a joint type{}", type, did_you_mean(type, names)));
  }
  return JointType::fixed;
}

std::optional<double> Parser::rate_limit(const XmlNode& limit, const char* name) {
  const XmlAttribute* attribute = limit.find(name);
  if (attribute == nullptr) return std::nullopt;
  newer_.uses(fmt::format("{} of <limit>", name), kUrdf12, attribute->where);
  UrdfReader read(diagnostics_, "urdf.optional_value", "the joint is treated as without it");
  const auto value = read.number(limit, name);
  if (!value || *value >= 0) return value;
  read.fault("urdf.number", attribute->where, fmt::format("the {} limit {} is negative", name, *value),
             "write it as a positive number");
  return std::nullopt;
}

std::optional<JointLimits> Parser::limits(const XmlNode& node, const Joint& joint) {
  JointLimits out;
  out.source = node.where;
  const auto lower = read_.number(node, "lower"), upper = read_.number(node, "upper");
  out.has_position = lower || upper;
  out.lower = lower.value_or(0.0);
  out.upper = upper.value_or(0.0);
  out.effort = read_.number(node, "effort");
  out.velocity = read_.number(node, "velocity");
  for (const RateLimit& limit : kRateLimits) out.*limit.value = rate_limit(node, limit.name);
  if (out.lower > out.upper && joint.type != JointType::continuous) {
    diagnostics_.warning(
        "urdf.limits_crossed", node.where,
        fmt::format("the lower limit {} of '{}' is above the upper limit {}; they are exchanged", out.lower,
                    joint.name, out.upper),
        "exchange them, or correct the sign of one");
  }
  return out;
}

void Parser::joint_details(const XmlNode& node, Joint& out) {
  for (const XmlNode& child : node.children) {
    if (child.is("limit")) out.limits = limits(child, out);
    if (child.is("dynamics")) {
      out.dynamics = JointDynamics{read_.number_or(child, "damping", 0.0),
                                   read_.number_or(child, "friction", 0.0), child.where};
    }
    if (child.is("mimic")) {
      out.mimic = Mimic{read_.required(child, "joint"), read_.number_or(child, "multiplier", 1.0),
                        read_.number_or(child, "offset", 0.0), child.where};
    }
    if (child.is("safety_controller")) {
      UrdfReader read(diagnostics_, "urdf.optional_value", "it is read as 0");
      out.safety = SafetyController{
          read.number_or(child, "soft_lower_limit", 0.0), read.number_or(child, "soft_upper_limit", 0.0),
          read.number_or(child, "k_position", 0.0), read.number_or(child, "k_velocity", 0.0), child.where};
    }
    if (child.is("calibration")) {
      UrdfReader read(diagnostics_, "urdf.optional_value", "it is ignored");
      out.calibration = JointCalibration{read.number(child, "rising"), read.number(child, "falling")};
    }
  }
}

Joint Parser::joint(const XmlNode& node) {
  Joint out;
  out.name = read_.required(node, "name");
  out.source = node.where;
  out.type = joint_type(node);
  for (const auto& [tag, target] : {std::pair{"parent", &out.parent}, std::pair{"child", &out.child}}) {
    const XmlNode* end = node.first(tag);
    if (end == nullptr) {
      diagnostics_.error("urdf.joint_end", node.where,
                         fmt::format("the joint '{}' has no <{}>", out.name, tag),
                         fmt::format("write <{} link=\"...\"/>", tag));
    } else {
      *target = read_.required(*end, "link");
    }
  }
  out.origin = origin(node, read_);
  const bool has_axis = out.type != JointType::fixed && out.type != JointType::floating;
  if (const XmlNode* axis = node.first("axis")) {
    out.axis_source = axis->where;
    UrdfReader unused(diagnostics_, "urdf.optional_value", "a joint of this type has no axis");
    if (const auto xyz = (has_axis ? read_ : unused).vector<3>(*axis, "xyz")) out.axis = *xyz;
  }
  if (has_axis && !has_direction(out)) {
    diagnostics_.warning("urdf.axis_zero", out.axis_source,
                         fmt::format("the axis of '{}' is zero, so the joint does not move", out.name),
                         "write a direction, such as <axis xyz=\"0 0 1\"/>");
  } else if (has_axis && std::abs(out.axis.norm() - 1.0) > 1e-3) {
    diagnostics_.note(
        "urdf.axis_not_unit", out.axis_source,
        fmt::format("the axis of '{}' has the length {:.6g}; it is normalised", out.name, out.axis.norm()));
  }
  joint_details(node, out);
  return out;
}

// A visual's material may refer to one that is defined in the robot or in another visual.
void Parser::look_up_materials(RobotDescription& robot) {
  std::map<std::string, Material> known;
  for (const Material& m : robot.materials) known.emplace(m.name, m);
  for (const Link& link : robot.links) {
    for (const Visual& visual : link.visuals) {
      if (visual.material && !visual.material->name.empty() &&
          (visual.material->rgba || !visual.material->texture.empty())) {
        known.emplace(visual.material->name, *visual.material);
      }
    }
  }
  std::vector<std::string> names;
  for (const auto& [name, value] : known) names.push_back(name);
  for (Link& link : robot.links) {
    for (Visual& visual : link.visuals) {
      if (!visual.material || visual.material->rgba || !visual.material->texture.empty()) continue;
      if (const auto found = known.find(visual.material->name); found != known.end()) {
        visual.material->rgba = found->second.rgba;
        visual.material->texture = found->second.texture;
      } else if (!visual.material->name.empty()) {
        diagnostics_.note("urdf.unknown_material", visual.material->source,
                          fmt::format("the material '{}' has no colour{}", visual.material->name,
                                      did_you_mean(visual.material->name, names)));
      }
    }
  }
}

// A component without a name cannot be referred to, and ros2_control rejects it.
void Parser::hardware(const XmlNode& node, RobotDescription& out) {
  UrdfReader read(diagnostics_, "urdf.optional_value", "this <ros2_control> is ignored");
  if (!read.required(node, "name").empty() || !read.faulty())
    out.hardware.push_back(read_hardware(node, diagnostics_));
}

RobotDescription Parser::robot(const XmlNode& root) {
  RobotDescription out;
  out.source = root.where;
  if (root.name != "robot") {
    diagnostics_.error("urdf.no_robot", root.where,
                       fmt::format("the root element is <{}>, not <robot>", root.name), fix_of_root(root));
    return out;
  }
  out.name = read_.required(root, "name");
  version_ = read_urdf_version(root, diagnostics_);
  for (const XmlNode& child : root.children) {
    if (child.kind != XmlNode::Kind::element) continue;
    if (child.name == "link")
      out.links.push_back(link(child));
    else if (child.name == "joint")
      out.joints.push_back(joint(child));
    else if (child.name == "material")
      out.materials.push_back(*material(child));
    else if (child.name == "ros2_control")
      hardware(child, out);
    else if (child.name == "gazebo")
      out.gazebo.push_back(read_gazebo(child, base_, resolver_, diagnostics_));
    else if (child.name == "transmission")
      out.transmissions.push_back(read_transmission(child, diagnostics_));
    else
      out.unknown.emplace_back(to_xml(child), child.where);
  }
  if (out.links.empty()) {
    diagnostics_.error("urdf.no_links", root.where, fmt::format("the robot '{}' has no links", out.name));
  }
  newer_.report(version_, diagnostics_);
  look_up_materials(out);
  return out;
}

}  // namespace

std::string fix_of_root(const XmlNode& root) {
  return root.name == "sdf" ? "bring up an SDF file, a world or a model, by --world FILE"
                            : "give a URDF file, or a xacro file that expands to one";
}

RobotDescription read_urdf(const XmlNode& root, const std::filesystem::path& base,
                           const PackageResolver& resolver, Diagnostics& diagnostics) {
  return Parser(base, resolver, diagnostics).robot(root);
}

}  // namespace doppel
