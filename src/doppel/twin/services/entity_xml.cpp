#include "doppel/twin/services/detail/entity_xml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <numbers>
#include <sstream>
#include <utility>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/base/math/pose.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/urdf/load.h"
#include "doppel/description/urdf/urdf_reader.h"
#include "doppel/description/urdf/urdf_version.h"
#include "doppel/robot/collision/size_limits.h"
#include "doppel/twin/entities/entity.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxTextBytes = std::size_t{1} << 20;
constexpr double kMaxFriction = 100;
constexpr const char* kInvalid = "entity.invalid";

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream words(text);
  return {std::istream_iterator<std::string>(words), {}};
}

// True if two texts have the same words, with numbers compared by value.
bool same_text(const std::string& a, const std::string& b) {
  return std::ranges::equal(words_of(a), words_of(b), [](const std::string& x, const std::string& y) {
    const auto number = parse_number(x);
    return x == y || (number && number == parse_number(y));
  });
}

bool same_xml(const XmlNode& a, const XmlNode& b) {
  const auto same_attribute = [&b](const XmlAttribute& attribute) {
    const XmlAttribute* other = b.find(attribute.name);
    return other != nullptr && same_text(attribute.value, other->value);
  };
  return a.name == b.name && same_text(a.text, b.text) && a.attributes.size() == b.attributes.size() &&
         std::ranges::all_of(a.attributes, same_attribute) &&
         std::ranges::equal(a.children, b.children, same_xml);
}

// Bounded numbers, shapes, and elements that must exist once.
class Reader {
 public:
  Reader(const MeshFinder& find_mesh, Diagnostics& notes) : find_mesh_(find_mesh), notes_(notes) {}

 protected:
  void error(const XmlNode& node, const std::string& message, const std::string& fix = "") {
    errors_.error(kInvalid, node.where, message, fix);
  }
  void has_no_effect(const XmlNode& node) {
    notes_.note("entity.no_effect", node.where, fmt::format("<{}> has no effect on an object", node.name));
  }

  // An object's mass is distributed evenly over its shape; other values of the text are not used.
  void note_inertial(const XmlNode& inertial) {
    for (const XmlNode& child : inertial.children) {
      if (child.kind == XmlNode::Kind::element && !child.is("mass")) has_no_effect(child);
    }
  }
  // A pose that is not written, or is all zeros.
  static bool moves_nothing(const XmlNode* pose) {
    if (pose == nullptr) return true;
    std::string text = pose->content();
    for (const XmlAttribute& attribute : pose->attributes) text += ' ' + attribute.value;
    return std::ranges::all_of(words_of(text),
                               [](const std::string& word) { return parse_number(word) == 0.0; });
  }
  // An object is drawn with its collision shape.
  void note_visuals(const XmlNode& link, const XmlNode& carrier, std::string_view place) {
    const auto same = [](const XmlNode* a, const XmlNode* b) {
      return a != nullptr && b != nullptr && same_xml(*a, *b);
    };
    for (const XmlNode* visual : all(link, "visual")) {
      const XmlNode *here = visual->first(place), *there = carrier.first(place);
      const bool same_place = (moves_nothing(here) && moves_nothing(there)) || same(here, there);
      if (visual == &carrier || (same_place && same(visual->first("geometry"), carrier.first("geometry"))))
        continue;
      notes_.note("entity.visual", visual->where,
                  "the <visual> differs from the <collision> in shape or pose and is ignored: an object is "
                  "drawn with its collision shape");
    }
  }

  static std::vector<const XmlNode*> all(const XmlNode& node, std::string_view name) {
    std::vector<const XmlNode*> out;
    for (const XmlNode& child : node.children) {
      if (child.is(name)) out.push_back(&child);
    }
    return out;
  }

  // Numbers separated by blanks, from `least` to `most` of them.
  std::vector<double> numbers(const XmlNode& node, const std::string& text, std::size_t least,
                              std::size_t most) {
    std::vector<double> out;
    std::istringstream words(text);
    for (std::string word; words >> word && out.size() <= most;) {
      const auto value = parse_number(word);
      if (!value) {
        error(node, fmt::format("<{}> is '{}', which is not a finite number", node.name, word.substr(0, 40)));
        return {};
      }
      out.push_back(*value);
    }
    if (out.size() >= least && out.size() <= most) return out;
    error(node, fmt::format("<{}> takes {} numbers, not '{}'", node.name,
                            least == most ? std::to_string(least) : fmt::format("{} or {}", least, most),
                            text.substr(0, 60)));
    return {};
  }

  Eigen::Vector3d triple(const XmlNode& node, const std::string& text) {
    const std::vector<double> found = numbers(node, text, 3, 3);
    return found.empty() ? Eigen::Vector3d(Eigen::Vector3d::Ones())
                         : Eigen::Vector3d(found[0], found[1], found[2]);
  }

  void check_value(const SourceLocation& where, const char* what, double value, double low, double high,
                   const char* unit) {
    check_range(what, value, low, high, unit, kInvalid, where, errors_);
  }
  void check_shape(const SourceLocation& where, const Geometry& shape) {
    check_sizes(shape, kInvalid, where, errors_);
  }
  void check_pose(const SourceLocation& where, const Pose& pose) {
    check_distance(pose, kInvalid, where, errors_);
  }
  double mass_from(const XmlNode& node, std::optional<double> value) {
    if (!value) return kMinBodyMass;  // already reported
    check_mass(*value, kInvalid, node.where, errors_);
    return *value;
  }

  void set_color(const XmlNode& node, const std::string& text, WorldObject& object) {
    const std::vector<double> found = numbers(node, text, 3, 4);
    for (std::size_t i = 0; i < found.size(); ++i) {
      object.rgba[static_cast<Eigen::Index>(i)] = found[i];
      check_value(node.where, "colour", found[i], 0, 1, "");
    }
  }

  // The one element below <geometry> that is a shape; nullptr and an error if there is none or several.
  const XmlNode* shape_below(const XmlNode& parent, const std::vector<std::string>& kinds) {
    const XmlNode* geometry = parent.first("geometry");
    if (geometry == nullptr) {
      error(parent, fmt::format("<{}> has no <geometry>", parent.name));
      return nullptr;
    }
    const XmlNode* found = nullptr;
    for (const XmlNode& child : geometry->children) {
      if (child.kind != XmlNode::Kind::element) continue;
      if (std::ranges::find(kinds, child.name) == kinds.end()) {
        error(child, fmt::format("<{}> is not a shape of an object{}", child.name.substr(0, 40),
                                 did_you_mean(child.name.substr(0, 40), kinds)));
        return nullptr;
      }
      if (found != nullptr) {
        error(child, "a <geometry> must have one shape, not two");
        return nullptr;
      }
      found = &child;
    }
    if (found == nullptr) error(*geometry, "<geometry> contains no shape");
    return found;
  }

  MeshGeometry mesh_from(const XmlNode& node, const std::string& uri, const Eigen::Vector3d& scale) {
    MeshGeometry mesh{uri, scale, ""};
    try {
      mesh.path = find_mesh_(uri).string();
    } catch (const InputError& refused) {
      for (const Diagnostic& diagnostic : refused.diagnostics())
        errors_.error(diagnostic.rule, node.where, diagnostic.message, diagnostic.fix);
    }
    return mesh;
  }

  // The shape's element among the link's <collision> and <visual>; a second one is an error.
  const XmlNode* carrier_of_shape(const XmlNode& link) {
    const auto collisions = all(link, "collision"), visuals = all(link, "visual");
    const auto& carriers = collisions.empty() ? visuals : collisions;
    if (carriers.empty()) {
      error(link, "the link has no shape: neither <collision> nor <visual>");
      return nullptr;
    }
    if (carriers.size() > 1) {
      error(*carriers[1], fmt::format("a second <{}>; an object has one shape", carriers[1]->name),
            "spawn several objects, or one mesh");
    }
    return carriers.front();
  }

  const XmlNode* only_link(const XmlNode& parent) {
    const auto links = all(parent, "link");
    if (links.size() == 1) return links.front();
    error(links.empty() ? parent : *links[1],
          fmt::format("an object must have one link, this has {}", links.size()),
          "robots are started with `doppel up`");
    return nullptr;
  }

  const MeshFinder& find_mesh_;
  Diagnostics& notes_;
  Diagnostics errors_;
};

// Bounds of what is accepted from a client: shapes, mass and pose of every link.
class ModelCheck : private Reader {
 public:
  using Reader::Reader;

  void check(const SdfModel& model) {
    std::size_t shapes = 0;
    for (const Link& link : model.description->links) {
      for (const Visual& visual : link.visuals) check_shape(visual.source, visual.geometry);
      for (const Collision& collision : link.collisions) check_shape(collision.source, collision.geometry);
      shapes += link.visuals.size() + link.collisions.size();
      if (link.inertial) check_mass(link.inertial->mass, kInvalid, link.inertial->source, errors_);
    }
    if (shapes == 0)
      errors_.error(kInvalid, model.source, "the model has no shape: neither <collision> nor <visual>");
    check_pose(model.source, model.X_WR);
    for (const Joint& joint : model.description->joints) check_pose(joint.source, joint.origin.pose());
    errors_.throw_if_errors();
  }
};

EntityText read_sdf(const std::string& xml, const MeshFinder& find_mesh, Diagnostics& notes) {
  SdfWorld world = parse_sdf(xml, "xml", find_mesh, notes);
  const auto top = [](const SdfModel& model) { return model.name.find("::") == std::string::npos; };
  const auto models = std::ranges::count_if(world.models, top);
  if (models != 1 || world.is_world) {
    const SourceLocation where =
        world.models.empty() ? make_location("xml", 1, 1) : world.models.front().source;
    throw InputError(kInvalid, where,
                     world.is_world
                         ? "this is a world; an entity must be one <model>"
                         : fmt::format("the SDF has {} models; an entity must be one <model>", models),
                     "start a world with: doppel up --world FILE");
  }
  for (const SdfModel& model : world.models) {
    ModelCheck(find_mesh, notes).check(model);
    for (const SdfSensor& sensor : model.sensors)
      notes.note("entity.no_effect", sensor.source,
                 fmt::format(
                     "the sensor type '{}' has an effect only if a plugin drives the model: sensors of other "
                     "spawned models are not simulated",
                     sensor.type));
  }
  const std::string name = std::ranges::find_if(world.models, top)->name;
  return {name, std::move(world.models)};
}

class UrdfEntityReader : private Reader {
 public:
  using Reader::Reader;

  WorldObject read(const XmlNode& robot) {
    WorldObject object;
    object.name = UrdfReader::optional(robot, "name");
    for (const XmlNode& child : robot.children) {
      if (child.is("joint")) error(child, "a <joint>; an object is one link");
      if (child.kind == XmlNode::Kind::element && !child.is("joint") && !child.is("link") &&
          !child.is("material"))
        has_no_effect(child);
    }
    if (const XmlNode* link = only_link(robot)) read_link(robot, *link, object);
    for (const Diagnostic& diagnostic : attributes_.all()) errors_.add(diagnostic);
    errors_.throw_if_errors();
    return object;
  }

 private:
  void read_link(const XmlNode& robot, const XmlNode& link, WorldObject& object) {
    object.mass = 0;  // without an inertia it is fixed to the world
    if (const XmlNode* inertial = link.first("inertial")) {
      if (const XmlNode* mass = inertial->first("mass"))
        object.mass = mass_from(*mass, from_.number(*mass, "value"));
      note_inertial(*inertial);
    }
    if (const XmlNode* visual = link.first("visual")) read_color(robot, *visual, object);
    const XmlNode* carrier = carrier_of_shape(link);
    if (carrier == nullptr) return;
    note_visuals(link, *carrier, "origin");
    if (const XmlNode* origin = carrier->first("origin")) {
      const XmlAttribute* quaternion = origin->find("quat_xyzw");
      const auto rpy = quaternion == nullptr ? std::nullopt : rpy_of_quaternion(quaternion->value);
      if (quaternion != nullptr && !rpy)
        error(*origin, "quat_xyzw of <origin> is not four finite numbers with a length above 0");
      if (quaternion != nullptr && origin->find("rpy") != nullptr)
        error(*origin, "<origin> has both rpy and quat_xyzw", "remove one of the two");
      object.X_OS = make_pose(vector(*origin, "xyz", Eigen::Vector3d::Zero()),
                              vector(*origin, "rpy", rpy.value_or(Eigen::Vector3d::Zero())));
      check_pose(origin->where, object.X_OS);
    }
    if (const XmlNode* shape = shape_below(*carrier, {"box", "sphere", "cylinder", "capsule", "mesh"})) {
      object.shape = geometry(*shape);
      check_shape(shape->where, object.shape);
    }
  }

  // Its own colour, or that of the robot's material of this name.
  void read_color(const XmlNode& robot, const XmlNode& visual, WorldObject& object) {
    const XmlNode* material = visual.first("material");
    if (material == nullptr) return;
    const XmlNode* color = material->first("color");
    for (const XmlNode* shared : all(robot, "material")) {
      if (color == nullptr &&
          UrdfReader::optional(*shared, "name") == UrdfReader::optional(*material, "name"))
        color = shared->first("color");
    }
    if (color != nullptr) set_color(*color, UrdfReader::optional(*color, "rgba"), object);
  }

  Geometry geometry(const XmlNode& shape) {
    const auto length = [&](const char* name) {
      from_.required(shape, name);
      return from_.number(shape, name).value_or(kMinShapeSize);
    };
    if (shape.is("box")) {
      from_.required(shape, "size");
      return Box{vector(shape, "size", Eigen::Vector3d::Ones())};
    }
    if (shape.is("sphere")) return Sphere{length("radius")};
    if (shape.is("cylinder")) return Cylinder{length("radius"), length("length")};
    if (shape.is("capsule")) return Capsule{length("radius"), length("length")};
    return mesh_from(shape, from_.required(shape, "filename"),
                     vector(shape, "scale", Eigen::Vector3d::Ones()));
  }

  Eigen::Vector3d vector(const XmlNode& node, const char* name, const Eigen::Vector3d& fallback) {
    return from_.vector<3>(node, name).value_or(fallback);
  }

  Diagnostics attributes_;
  UrdfReader from_{attributes_};
};

bool is_rigid(const XmlNode& joint) {
  return UrdfReader::optional(joint, "type") == "fixed" && joint.first("parent") != nullptr &&
         joint.first("child") != nullptr;
}

// A URDF of which every part is simulated: with the <inertia> of its author, or of several links that fixed
// joints connect.
bool is_whole_body(const XmlNode& robot) {
  std::size_t links = 0;
  bool has_inertia = false;
  for (const XmlNode& child : robot.children) {
    if (child.is("joint") && !is_rigid(child)) return false;
    if (!child.is("link")) continue;
    ++links;
    const XmlNode* const inertial = child.first("inertial");
    has_inertia = has_inertia || (inertial != nullptr && inertial->first("inertia") != nullptr);
  }
  return links > 1 || has_inertia;
}

// The value of <gazebo><doppel:base>.
const XmlNode* base_node(const XmlNode& robot) {
  for (const XmlNode& child : robot.children) {
    if (!child.is("gazebo")) continue;
    if (const XmlNode* const base = child.first("doppel:base")) return base;
  }
  return nullptr;
}

std::optional<BaseKind> base_of(const XmlNode& robot) {
  const XmlNode* const node = base_node(robot);
  if (node == nullptr) return std::nullopt;
  const std::string text = node->content();
  if (text == "fixed") return BaseKind::fixed;
  if (text == "floating") return BaseKind::floating;
  throw InputError(kInvalid, node->where,
                   fmt::format("<doppel:base> is '{}'; it can be fixed or floating", text.substr(0, 40)));
}

EntityText read_body(const XmlNode& root, const std::string& xml, const MeshFinder& find_mesh,
                     Diagnostics& notes) {
  PackageResolver nowhere;
  Diagnostics findings;
  auto robot = std::make_shared<RobotDescription>(parse_urdf(xml, "xml", nowhere, findings));
  for (const Diagnostic& one : findings.all()) {
    if (one.severity == Severity::error) throw InputError(findings.all());
    if (!one.rule.starts_with("mesh.") && !one.rule.starts_with("package.")) notes.add(one);
  }
  // Only the files that a client may read.
  const auto find = [&](Geometry& geometry) {
    if (auto* const mesh = std::get_if<MeshGeometry>(&geometry)) mesh->path = find_mesh(mesh->uri).string();
  };
  bool has_mass = false;
  for (Link& link : robot->links) {
    for (Collision& collision : link.collisions) find(collision.geometry);
    for (Visual& visual : link.visuals) {
      find(visual.geometry);
      if (visual.material) visual.material->texture_path.clear();
    }
    has_mass = has_mass || (link.inertial && link.inertial->mass > 0);
  }
  SdfModel model;
  model.name = robot->name;
  const bool stands = robot->find_link("world") != nullptr || !has_mass;
  model.base = base_of(root).value_or(stands ? BaseKind::fixed : BaseKind::floating);
  model.is_static = model.base == BaseKind::fixed;
  model.source = root.where;
  model.description = std::move(robot);
  ModelCheck(find_mesh, notes).check(model);
  const std::string name = model.name;
  return {name, std::vector<SdfModel>{std::move(model)}};
}

}  // namespace

EntityText read_entity_xml(std::string_view xml, const MeshFinder& find_mesh, Diagnostics& notes) {
  if (xml.size() > kMaxTextBytes)
    throw InputError(kInvalid, {},
                     fmt::format("the xml has {} bytes; at most {} are read", xml.size(), kMaxTextBytes));
  const XmlNode root = parse_xml(xml, "xml");
  if (root.is("sdf")) return read_sdf(std::string(xml), find_mesh, notes);
  if (root.is("robot") && is_whole_body(root)) return read_body(root, std::string(xml), find_mesh, notes);
  if (root.is("robot")) {
    WorldObject object = UrdfEntityReader(find_mesh, notes).read(root);
    return {object.name, object};
  }
  throw InputError(kInvalid, root.where,
                   fmt::format("<{}> is neither <sdf> nor <robot>", root.name.substr(0, 40)),
                   "send SDF with one <model>, or a URDF with one <link>");
}

std::vector<ModelInstance> instances_of(const EntityText& entity, const std::string& name, const Pose& X_WE,
                                        Diagnostics& notes) {
  CollisionMeshes meshes;
  std::vector<ModelInstance> out;
  if (const auto* object = std::get_if<WorldObject>(&entity.made_of)) {
    WorldObject placed = *object;
    placed.name = name;
    placed.X_WO = X_WE * placed.X_WO;
    out.push_back(make_instance(placed, meshes, notes));
    return out;
  }
  for (const SdfModel& model : std::get<std::vector<SdfModel>>(entity.made_of)) {
    SdfModel placed = model;
    placed.X_WR = X_WE * model.X_WR;
    out.push_back(make_instance(placed, name + model.name.substr(entity.name.size()), meshes, notes));
  }
  return out;
}

std::optional<BaseKind> base_in_xml(std::string_view xml) {
  const XmlNode root = parse_xml(xml, "xml");
  return root.is("robot") ? base_of(root) : std::nullopt;
}

std::string robot_in_xml(std::string_view xml) {
  if (xml.size() > kMaxTextBytes) return "";
  try {
    const XmlNode root = parse_xml(xml, "xml");
    const auto moves = [](const XmlNode& child) {
      const bool acts =
          child.is("gazebo") && (child.first("plugin") != nullptr || child.first("sensor") != nullptr);
      return child.is("ros2_control") || acts || (child.is("joint") && !is_rigid(child));
    };
    const auto links =
        std::ranges::count_if(root.children, [](const XmlNode& child) { return child.is("link"); });
    const bool driven = root.first("ros2_control") != nullptr;
    if (!root.is("robot") || (links < 2 && !driven) || std::ranges::none_of(root.children, moves)) return "";
    const std::string name = UrdfReader::optional(root, "name");
    return name.empty() ? "robot" : name;
  } catch (const InputError&) {
    return "";  // reported by read_entity_xml()
  }
}

}  // namespace doppel
