#include "doppel/physics/contract/world.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/base/core/yaml_fix.h"
#include "doppel/robot/collision/size_limits.h"

namespace doppel {
namespace {

// Reads one file and collects all of its errors.
class WorldReader {
 public:
  WorldReader(const std::filesystem::path& file, PackageResolver& resolver)
      : file_(std::make_shared<const std::string>(file.string())),
        folder_(file.parent_path()),
        resolver_(resolver) {}

  World read() {
    YAML::Node root;
    try {
      root = YAML::LoadFile(*file_);
    } catch (const YAML::ParserException& error) {
      throw InputError("world.syntax", at(error.mark), "this is not YAML: " + error.msg, yaml_fix(error.msg));
    } catch (const YAML::BadFile&) {
      throw InputError("world.unreadable", at(YAML::Mark::null_mark()), "the world file cannot be read",
                       "give a file that exists and is readable");
    }
    World world;
    if (root.IsNull()) return world;
    if (fields(root, "a world",
               {"name", "gravity", "step", "integrator", "ground", "friction_rule", "robot", "robots",
                "objects"})) {
      read_world(root, world);
    }
    errors_.throw_if_errors();
    return world;
  }

 private:
  [[nodiscard]] SourceLocation at(const YAML::Mark& mark) const {
    SourceLocation where;
    where.file = file_;
    if (mark.is_null()) return where;
    where.line = mark.line + 1;
    where.column = mark.column + 1;
    return where;
  }

  void error(const YAML::Node& node, const std::string& message, const std::string& fix = "") {
    errors_.error("world.invalid", at(node.Mark()), message, fix);
  }

  // True where `node` is a map; every key that is not among `known` is an error.
  bool fields(const YAML::Node& node, const std::string& what, const std::vector<std::string>& known) {
    if (!node.IsMap()) {
      error(node, what + " must be a map");
      return false;
    }
    std::set<std::string> seen;
    for (const auto& field : node) {
      const std::string key = field.first.IsScalar() ? field.first.Scalar() : "";
      if (std::find(known.begin(), known.end(), key) == known.end()) {
        errors_.error("world.unknown_key", at(field.first.Mark()),
                      fmt::format("{} has no key '{}'{}", what, key, did_you_mean(key, known)));
      } else if (!seen.insert(key).second) {
        error(field.first, fmt::format("the key '{}' is given twice", key));
      }
    }
    return true;
  }

  double number(const YAML::Node& node, const std::string& what) {
    double value = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
      error(node, fmt::format("{} must be a number{}", what,
                              node.IsScalar() ? ", not '" + node.Scalar() + "'" : ""));
      return 0;
    }
    return value;
  }

  double not_negative(const YAML::Node& node, const std::string& what) {
    const double value = number(node, what);
    if (value < 0) error(node, fmt::format("{} is {}, but cannot be negative", what, value));
    return value;
  }

  double positive(const YAML::Node& node, const std::string& what) {
    if (!node) return 0;
    const double value = number(node, what);
    if (value <= 0) error(node, fmt::format("{} is {}, but must be positive", what, value));
    return value;
  }

  template <int N>
  Eigen::Matrix<double, N, 1> vector(const YAML::Node& node, const std::string& what) {
    Eigen::Matrix<double, N, 1> out = Eigen::Matrix<double, N, 1>::Zero();
    if (!node.IsSequence() || node.size() != N) {
      error(node, fmt::format("{} must be a list of {} numbers", what, N));
      return out;
    }
    for (int i = 0; i < N; ++i) out[i] = number(node[i], what);
    return out;
  }

  std::string text(const YAML::Node& node, const std::string& what) {
    if (node.IsScalar() && !node.Scalar().empty()) return node.Scalar();
    error(node, what + " must be a string");
    return "";
  }

  Pose pose(const YAML::Node& node) {
    const Eigen::Vector3d xyz =
        node["xyz"] ? vector<3>(node["xyz"], "xyz") : Eigen::Vector3d(Eigen::Vector3d::Zero());
    const Eigen::Vector3d rpy =
        node["rpy"] ? vector<3>(node["rpy"], "rpy") : Eigen::Vector3d(Eigen::Vector3d::Zero());
    return make_pose(xyz, rpy);
  }

  void read_world(const YAML::Node& root, World& world) {
    world.name = std::filesystem::path(*file_).stem().string();
    if (root["name"]) world.name = text(root["name"], "name");
    if (root["gravity"]) world.gravity = vector<3>(root["gravity"], "gravity");
    if (root["step"]) {
      world.step = step(root["step"]);
      world.step_is_given = true;
    }
    if (root["integrator"]) world.integrator = integrator(root["integrator"]);
    if (root["ground"]) read_ground(root["ground"], world);
    if (root["friction_rule"]) {
      const bool smaller = choice(root["friction_rule"], "friction_rule", {"max", "min"}) == 1;
      world.friction_rule = smaller ? FrictionRule::smaller : FrictionRule::larger;
    }
    if (root["robot"] && fields(root["robot"], "the robot's pose", {"xyz", "rpy"}))
      world.X_WR = pose(root["robot"]);
    if (root["robots"]) read_robots(root["robots"], world);
    if (root["objects"]) read_objects(root["objects"], world);
  }

  Duration step(const YAML::Node& node) {
    const double seconds = number(node, "step");
    if (seconds >= kMinStep && seconds <= kMaxStep) return from_seconds(seconds);
    error(node, fmt::format("step is {} s, but must be from {} to {} s", seconds, kMinStep, kMaxStep),
          "write 0.001 for a step of 1 ms");
    return World{}.step;
  }

  Integrator integrator(const YAML::Node& node) {
    try {
      return integrator_named(text(node, "integrator"), "world.invalid", at(node.Mark()));
    } catch (const InputError& unknown) {  // the file's other errors are reported with it
      for (const Diagnostic& diagnostic : unknown.diagnostics()) errors_.add(diagnostic);
      return World{}.integrator;
    }
  }

  double restitution(const YAML::Node& node) {
    const double out = not_negative(node, "restitution");
    if (out > 1) error(node, "restitution must be from 0 (no rebound) to 1 (no loss)");
    return out;
  }

  void read_ground(const YAML::Node& node, World& world) {
    if (node.IsScalar()) {
      if (!YAML::convert<bool>::decode(node, world.ground)) {
        error(node,
              fmt::format("ground must be true, false or a map with its friction or restitution, not '{}'",
                          node.Scalar()));
      }
    } else if (fields(node, "the ground", {"friction", "restitution"})) {
      if (node["friction"]) world.ground_friction = not_negative(node["friction"], "friction");
      if (node["restitution"]) world.ground_restitution = restitution(node["restitution"]);
    }
  }

  void read_robots(const YAML::Node& node, World& world) {
    if (!node.IsSequence()) return error(node, "robots must be a list");
    for (const auto& item : node) {
      if (fields(item, "a robot",
                 {"robot", "namespace", "xyz", "rpy", "controllers", "arguments", "base", "tf"}))
        world.robots.push_back(read_robot(item));
    }
  }

  WorldRobot read_robot(const YAML::Node& node) {
    WorldRobot robot;
    robot.source = at(node.Mark());
    if (node["robot"]) {
      robot.target = file_or_name(text(node["robot"], "robot"));
    } else {
      error(node, "a robot needs the key 'robot'", "give a bundled robot, a file or a package folder");
    }
    if (node["namespace"]) {
      robot.name_space = text(node["namespace"], "namespace");
      if (robot.name_space.starts_with('/')) robot.name_space.erase(0, 1);
    }
    if (node["xyz"] || node["rpy"]) robot.X_WR = pose(node);
    if (node["controllers"]) robot.controllers = file_or_name(text(node["controllers"], "controllers"));
    if (node["arguments"]) read_arguments(node["arguments"], robot);
    if (node["base"]) {
      const std::vector<std::string> kinds{"fixed", "floating"};
      robot.base = choice(node["base"], "base", kinds) == 1 ? BaseKind::floating : BaseKind::fixed;
    }
    if (node["tf"]) {
      const std::vector<std::string> kinds(std::begin(kTfTopicsNames), std::end(kTfTopicsNames));
      robot.tf = static_cast<TfTopics>(choice(node["tf"], "tf", kinds));
    }
    return robot;
  }

  void read_arguments(const YAML::Node& node, WorldRobot& robot) {
    if (!node.IsMap()) return error(node, "arguments must be a map of names and values");
    for (const auto& argument : node) {
      if (argument.first.IsScalar() && argument.second.IsScalar()) {
        robot.arguments.emplace_back(argument.first.Scalar(), argument.second.Scalar());
      } else {
        error(argument.first, "an argument must be a name and one value");
      }
    }
  }

  // The index of the text among `known`; 0 and an error where it is none of them.
  std::size_t choice(const YAML::Node& node, const std::string& what, const std::vector<std::string>& known) {
    const std::string value = text(node, what);
    const auto found = std::find(known.begin(), known.end(), value);
    if (found != known.end()) return static_cast<std::size_t>(found - known.begin());
    error(node, fmt::format("{} is '{}'; it must be one of {}{}", what, value, fmt::join(known, ", "),
                            did_you_mean(value, known)));
    return 0;
  }

  // A file next to the world file has priority over a package or bundled robot of the same name.
  [[nodiscard]] std::string file_or_name(const std::string& written) const {
    std::error_code none;
    const std::filesystem::path beside = folder_ / written;
    return std::filesystem::exists(beside, none) ? beside.string() : written;
  }

  void read_objects(const YAML::Node& node, World& world) {
    if (!node.IsSequence()) {
      error(node, "objects must be a list");
      return;
    }
    std::map<std::string, SourceLocation> names;
    for (const auto& item : node) {
      if (!fields(item, "an object",
                  {"name", "box", "cylinder", "capsule", "sphere", "mesh", "xyz", "rpy", "mass", "friction",
                   "restitution", "color"})) {
        continue;
      }
      WorldObject object = read_object(item);
      if (object.name == "ground")
        error(item, "the name 'ground' is reserved for the ground", "choose another name");
      const auto [before, fresh] = names.emplace(object.name, object.source);
      if (!fresh && !object.name.empty()) {
        error(item, fmt::format("two objects are named '{}'; the first is at {}", object.name,
                                before->second.place()));
      }
      world.objects.push_back(std::move(object));
    }
  }

  WorldObject read_object(const YAML::Node& node) {
    WorldObject object;
    object.source = at(node.Mark());
    if (node["name"]) {
      object.name = text(node["name"], "name");
    } else {
      error(node, "an object needs a name");
    }
    read_shape(node, object);
    object.X_WO = pose(node);
    check_distance(object.X_WO, "world.invalid", node["xyz"] ? at(node["xyz"].Mark()) : object.source,
                   errors_);
    if (node["mass"]) object.mass = mass(node["mass"]);
    if (node["friction"]) object.friction = not_negative(node["friction"], "friction");
    if (node["restitution"]) object.restitution = restitution(node["restitution"]);
    if (node["color"]) {
      object.rgba = vector<4>(node["color"], "color");
      if (object.rgba.minCoeff() < 0 || object.rgba.maxCoeff() > 1) {
        error(node["color"], "color must be red, green, blue and opacity, each from 0 to 1");
      }
    }
    return object;
  }

  void read_shape(const YAML::Node& node, WorldObject& object) {
    const std::vector<std::string> kinds{"box", "cylinder", "capsule", "sphere", "mesh"};
    std::vector<std::string> found;
    std::copy_if(kinds.begin(), kinds.end(), std::back_inserter(found),
                 [&](const auto& kind) { return node[kind]; });
    if (found.size() != 1) {
      error(node,
            fmt::format(
                "an object must have exactly one shape (box, cylinder, capsule, sphere or mesh), not {}",
                found.size()));
      return;
    }
    const std::string& kind = found[0];
    const YAML::Node shape = node[kind];
    if (kind == "box") {
      const Eigen::Vector3d size = vector<3>(shape, "box");
      if (shape.IsSequence() && size.minCoeff() <= 0) error(shape, "the sides of a box must be positive");
      object.shape = Box{size};
    } else if (kind == "mesh") {
      object.shape = mesh(shape);
    } else if (kind == "sphere") {
      if (needs(shape, kind, {"radius"})) object.shape = Sphere{positive(shape["radius"], "radius")};
    } else if (needs(shape, kind, {"radius", "length"})) {
      const double radius = positive(shape["radius"], "radius"), length = positive(shape["length"], "length");
      if (kind == "cylinder") object.shape = Cylinder{radius, length};
      if (kind == "capsule") object.shape = Capsule{radius, length};
    }
    check_shape(shape, object.shape);
  }

  // 0: fixed to the world.
  double mass(const YAML::Node& node) {
    const double value = not_negative(node, "mass");
    if (value > 0) check_mass(value, "world.invalid", at(node.Mark()), errors_);
    return value;
  }

  // The sizes of a shape that has been reported as not positive are not reported again.
  void check_shape(const YAML::Node& node, const Geometry& shape) {
    if (size_span(shape).least > 0 || std::holds_alternative<MeshGeometry>(shape))
      check_sizes(shape, "world.invalid", at(node.Mark()), errors_);
  }

  bool needs(const YAML::Node& node, const std::string& what, const std::vector<std::string>& keys) {
    if (!fields(node, "a " + what, keys)) return false;
    for (const std::string& key : keys) {
      if (!node[key]) error(node, fmt::format("a {} needs a {}", what, key));
    }
    return true;
  }

  MeshGeometry mesh(const YAML::Node& node) {
    MeshGeometry out;
    if (node.IsScalar()) {
      out.uri = node.Scalar();
    } else if (fields(node, "a mesh", {"uri", "scale"})) {
      if (node["uri"]) out.uri = text(node["uri"], "uri");
      if (!node["uri"]) error(node, "a mesh needs a uri");
      if (node["scale"]) out.scale = vector<3>(node["scale"], "scale");
    }
    if (out.uri.empty()) return out;
    const PackageResolver::Resolved resolved = resolver_.resolve(out.uri, folder_);
    if (resolved.path.empty()) {
      error(node, fmt::format("the mesh '{}' is not found{}", out.uri,
                              resolved.nearest.empty() ? "" : "; did you mean '" + resolved.nearest + "'?"));
    }
    out.path = resolved.path.string();
    return out;
  }

  std::shared_ptr<const std::string> file_;
  std::filesystem::path folder_;
  PackageResolver& resolver_;
  Diagnostics errors_;
};

}  // namespace

Integrator integrator_named(const std::string& name, const std::string& rule, const SourceLocation& where) {
  const std::vector<std::string> known(std::begin(kIntegratorNames), std::end(kIntegratorNames));
  const auto found = std::find(known.begin(), known.end(), name);
  if (found != known.end()) return static_cast<Integrator>(found - known.begin());
  throw InputError(rule, where, fmt::format("unknown integrator '{}'{}", name, did_you_mean(name, known)),
                   "choose one of euler, midpoint, rk4 and implicit (doppel man physics.md)");
}

World load_world(const std::filesystem::path& file, PackageResolver& resolver) {
  const std::string extension = file.extension().string();
  if (extension == ".urdf" || extension == ".xacro") {
    throw InputError(
        "world.invalid", make_location(file.string()), "this is the description of a robot, not a world",
        "pass it as the target (doppel up FILE), or spawn it in the running twin (doppel spawn FILE)");
  }
  return WorldReader(file, resolver).read();
}

}  // namespace doppel
