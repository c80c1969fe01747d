#include "doppel/physics/contract/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/base/yaml/yaml_fields.h"
#include "doppel/physics/contract/keep_out.h"
#include "doppel/robot/collision/size_limits.h"

namespace doppel {
namespace {

const YamlRules kRules{"world.syntax", "world.unreadable", "world.too_large", "world.invalid",
                       "world.unknown_key"};

// Reads one file and collects all of its errors.
class WorldReader : YamlFields {
 public:
  WorldReader(const std::filesystem::path& file, PackageResolver& resolver)
      : YamlFields(kRules), file_(file), folder_(file.parent_path()), resolver_(resolver) {}

  World read() {
    const PlacedYaml root = load_yaml(file_, kRules, "world file");
    World world;
    if (root.is_null()) return world;
    if (fields(root, "a world",
               {"name", "gravity", "step", "integrator", "ground", "friction_rule", "robot", "robots",
                "objects", "keep_out"})) {
      read_world(root, world);
    }
    errors().throw_if_errors();
    return world;
  }
  [[nodiscard]] std::vector<KeepOutBox> keep_out() const { return keep_out_; }

 private:
  double not_negative(const PlacedYaml& node, const std::string& what) {
    const double value = number(node, what);
    if (value < 0) error(node, fmt::format("{} is {}, but cannot be negative", what, value));
    return value;
  }

  double positive(const PlacedYaml& node, const std::string& what) {
    if (!node) return 0;
    const double value = number(node, what);
    if (value <= 0) error(node, fmt::format("{} is {}, but must be positive", what, value));
    return value;
  }

  template <int N>
  Eigen::Matrix<double, N, 1> vector(const PlacedYaml& node, const std::string& what) {
    return Eigen::Matrix<double, N, 1>(numbers(node, what, N).data());
  }

  Pose pose(const PlacedYaml& node) {
    const Eigen::Vector3d xyz =
        node["xyz"] ? vector<3>(node["xyz"], "xyz") : Eigen::Vector3d(Eigen::Vector3d::Zero());
    const Eigen::Vector3d rpy =
        node["rpy"] ? vector<3>(node["rpy"], "rpy") : Eigen::Vector3d(Eigen::Vector3d::Zero());
    return make_pose(xyz, rpy);
  }

  void read_world(const PlacedYaml& root, World& world) {
    world.name = file_.stem().string();
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
    if (root["keep_out"]) read_keep_out(root["keep_out"]);
  }

  Duration step(const PlacedYaml& node) {
    const double seconds = number(node, "step");
    if (seconds >= kMinStep && seconds <= kMaxStep) return from_seconds(seconds);
    error(node, fmt::format("step is {} s, but must be from {} to {} s", seconds, kMinStep, kMaxStep),
          "write 0.001 for a step of 1 ms");
    return World{}.step;
  }

  Integrator integrator(const PlacedYaml& node) {
    try {
      return integrator_named(text(node, "integrator"), "world.invalid", node.where);
    } catch (const InputError& unknown) {  // the file's other errors are reported with it
      for (const Diagnostic& diagnostic : unknown.diagnostics()) errors().add(diagnostic);
      return World{}.integrator;
    }
  }

  double restitution(const PlacedYaml& node) {
    const double out = not_negative(node, "restitution");
    if (out > 1) error(node, "restitution must be from 0 (no rebound) to 1 (no loss)");
    return out;
  }

  void read_ground(const PlacedYaml& node, World& world) {
    if (node.is_scalar()) {
      const std::optional<bool> ground = flag_in(node);
      world.ground = ground.value_or(true);
      if (!ground) {
        error(node,
              fmt::format("ground must be true, false or a map with its friction or restitution, not '{}'",
                          node.text));
      }
    } else if (fields(node, "the ground", {"friction", "restitution"})) {
      if (node["friction"]) world.ground_friction = not_negative(node["friction"], "friction");
      if (node["restitution"]) world.ground_restitution = restitution(node["restitution"]);
    }
  }

  void read_robots(const PlacedYaml& node, World& world) {
    if (!node.is_list()) return error(node, "robots must be a list");
    for (const PlacedYaml& item : node.items) {
      if (fields(item, "a robot",
                 {"robot", "namespace", "xyz", "rpy", "controllers", "arguments", "base", "tf"}))
        world.robots.push_back(read_robot(item));
    }
  }

  WorldRobot read_robot(const PlacedYaml& node) {
    WorldRobot robot;
    robot.source = node.where;
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
    if (node["controllers"]) robot.controllers = {file_or_name(text(node["controllers"], "controllers"))};
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

  void read_arguments(const PlacedYaml& node, WorldRobot& robot) {
    if (!node.is_map()) return error(node, "arguments must be a map of names and values");
    for (std::size_t i = 0; i < node.keys.size(); ++i) {
      if (node.keys[i].is_scalar() && node.items[i].is_scalar()) {
        robot.arguments.emplace_back(node.keys[i].text, node.items[i].text);
      } else {
        error(node.keys[i], "an argument must be a name and one value");
      }
    }
  }

  // A file next to the world file has priority over a package or bundled robot of the same name.
  [[nodiscard]] std::string file_or_name(const std::string& written) const {
    std::error_code none;
    const std::filesystem::path beside = folder_ / written;
    return std::filesystem::exists(beside, none) ? beside.string() : written;
  }

  void read_keep_out(const PlacedYaml& node) {
    if (!node.is_list()) return error(node, "keep_out must be a list of boxes");
    for (const PlacedYaml& item : node.items) {
      if (!fields(item, "a keep-out box", {"name", "box", "xyz", "rpy"})) continue;
      if (!item["name"] || !item["box"]) {
        error(item, "a keep-out box needs a name and a box",
              "write {name: wall, box: [0.1, 2, 1], xyz: [...]}");
        continue;
      }
      KeepOutBox out;
      out.source = item.where;
      out.name = text(item["name"], "name");
      out.size = vector<3>(item["box"], "box");
      if (item["box"].is_list() && out.size.minCoeff() <= 0)
        error(item["box"], "the sides of a box must be positive");
      out.X_WB = pose(item);
      keep_out_.push_back(std::move(out));
    }
  }

  void read_objects(const PlacedYaml& node, World& world) {
    if (!node.is_list()) {
      error(node, "objects must be a list");
      return;
    }
    std::map<std::string, SourceLocation> names;
    for (const PlacedYaml& item : node.items) {
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

  WorldObject read_object(const PlacedYaml& node) {
    WorldObject object;
    object.source = node.where;
    if (node["name"]) {
      object.name = text(node["name"], "name");
    } else {
      error(node, "an object needs a name");
    }
    read_shape(node, object);
    object.X_WO = pose(node);
    check_distance(object.X_WO, "world.invalid", node["xyz"] ? node["xyz"].where : object.source, errors());
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

  void read_shape(const PlacedYaml& node, WorldObject& object) {
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
    const PlacedYaml& shape = node[kind];
    if (kind == "box") {
      const Eigen::Vector3d size = vector<3>(shape, "box");
      if (shape.is_list() && size.minCoeff() <= 0) error(shape, "the sides of a box must be positive");
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
  double mass(const PlacedYaml& node) {
    const double value = not_negative(node, "mass");
    if (value > 0) check_mass(value, "world.invalid", node.where, errors());
    return value;
  }

  // The sizes of a shape that has been reported as not positive are not reported again.
  void check_shape(const PlacedYaml& node, const Geometry& shape) {
    if (size_span(shape).least > 0 || std::holds_alternative<MeshGeometry>(shape))
      check_sizes(shape, "world.invalid", node.where, errors());
  }

  bool needs(const PlacedYaml& node, const std::string& what, const std::vector<std::string>& keys) {
    if (!fields(node, "a " + what, keys)) return false;
    for (const std::string& key : keys) {
      if (!node[key]) error(node, fmt::format("a {} needs a {}", what, key));
    }
    return true;
  }

  MeshGeometry mesh(const PlacedYaml& node) {
    MeshGeometry out;
    if (node.is_scalar()) {
      out.uri = node.text;
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

  std::filesystem::path file_, folder_;
  PackageResolver& resolver_;
  std::vector<KeepOutBox> keep_out_;
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

std::vector<KeepOutBox> load_keep_out(const std::filesystem::path& file, PackageResolver& resolver) {
  WorldReader reader(file, resolver);
  static_cast<void>(reader.read());
  return reader.keep_out();
}

}  // namespace doppel
