#include "doppel/scenario/sdf/sdf_world.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string_view>

#include "doppel/base/core/read_file.h"
#include "doppel/base/core/text.h"
#include "doppel/description/urdf/load.h"
#include "doppel/scenario/sdf/detail/model_search.h"
#include "doppel/scenario/sdf/detail/sdf_document.h"
#include "doppel/scenario/sdf/detail/sdf_trees.h"

namespace doppel {

namespace fs = std::filesystem;

namespace {

constexpr double kLevel = 1e-9;  // of a plane's normal; m of its height
constexpr std::size_t kMaxSdfBytes = std::size_t{64} << 20;

// A static horizontal plane at z = 0 is the ground of the engines, which has no borders.
void find_ground(SdfWorld& world) {
  for (SdfModel& model : world.models) {
    if (!model.is_static || model.description->joints.size() > 0) continue;
    auto robot = std::make_shared<RobotDescription>(*model.description);
    std::vector<Collision>& collisions = robot->links.front().collisions;
    const auto is_ground = [&](const Collision& collision) {
      const auto* const plane = std::get_if<Plane>(&collision.geometry);
      if (plane == nullptr) return false;
      const Pose X_WP = model.X_WR * collision.origin.pose();
      const Eigen::Vector3d up = X_WP.linear() * plane->normal.normalized();
      return up.z() > 1 - kLevel && std::abs(X_WP.translation().z()) < kLevel;
    };
    const auto found = std::find_if(collisions.begin(), collisions.end(), is_ground);
    if (found == collisions.end()) continue;
    if (!world.settings.ground || world.is_world) {
      world.settings.ground_friction = found->surface.mu.value_or(world.settings.ground_friction);
      world.settings.ground_restitution = found->surface.restitution;
    }
    world.settings.ground = true;
    collisions.erase(std::remove_if(collisions.begin(), collisions.end(), is_ground), collisions.end());
    model.description = std::move(robot);
  }
}

// The engines' plane has the name 'ground'.
void rename_ground(SdfWorld& world, Diagnostics& diagnostics) {
  for (SdfModel& model : world.models) {
    if (model.name != "ground") continue;
    std::string name = "ground_model";
    for (int i = 1; world.find(name) != nullptr; ++i) name = fmt::format("ground_model_{}", i);
    diagnostics.note(
        "sdf.renamed", model.source,
        fmt::format("the model 'ground' is named '{}' here, because 'ground' is the name of the plane z = 0",
                    name));
    auto description = std::make_shared<RobotDescription>(*model.description);
    description->name = name;
    model.description = std::move(description);
    model.name = std::move(name);
  }
}

// The system of gz-sim that a type of sensors needs; empty: of none that is known.
std::string_view system_of(std::string_view type) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kSystems{
      {{"imu", "imu"},
       {"force_torque", "forcetorque"},
       {"contact", "contact"},
       {"navsat", "navsat"},
       {"magnetometer", "magnetometer"},
       {"altimeter", "altimeter"},
       {"air_pressure", "air-pressure"},
       {"logical_camera", "logical-camera"}}};
  for (const auto& [name, system] : kSystems)
    if (type == name) return system;
  return type.ends_with("camera") || type.ends_with("lidar") ? "sensors" : "";
}

// Sensors that gz-sim would leave silent, because the world loads some systems, but not theirs: one note for each system.
void note_missing_systems(const SdfWorld& world, Diagnostics& diagnostics) {
  const auto loads = [&](std::string_view part) {
    return std::ranges::any_of(world.plugins, [&](const GazeboPlugin& plugin) {
      return plugin.filename.find(part) != std::string::npos;
    });
  };
  if (!loads("gz-sim-") && !loads("ignition-gazebo-")) return;
  std::set<std::string_view> noted;
  for (const SdfModel& model : world.models) {
    for (const SdfSensor& sensor : model.sensors) {
      const std::string_view system = system_of(sensor.type);
      if (system.empty() || loads(fmt::format("-{}-system", system)) || !noted.insert(system).second)
        continue;
      diagnostics.note(
          "sdf.sensor_system", sensor.source,
          fmt::format("the sensor '{}' works here; gz-sim would leave it silent, because the world does "
                      "not load the system of '{}' sensors",
                      sensor.name, sensor.type),
          fmt::format("add <plugin filename=\"gz-sim-{0}-system\" .../> to the <world>", system));
    }
  }
}

// `content`: the text, or the root of its tree.
template <class Content, class Search>
SdfWorld read(Content content, const std::string& name, const fs::path& folder, const Search& search,
              PackageResolver& resolver, Diagnostics& diagnostics) {
  Diagnostics found;
  sdf::Elements elements(found);
  sdf::Files files(search, found);
  sdf::Document document(elements, files, resolver);
  SdfWorld out;
  try {
    document.read(std::move(content), name, folder, out);
    document.frames().resolve_all(document.world());
    found.throw_if_errors();
    const sdf::StatePoses state = sdf::read_state(document.state(), elements);
    out.models = sdf::Trees(document.world(), document.frames(), elements, files, state).build();
    found.throw_if_errors();
  } catch (const InputError&) {
    for (const Diagnostic& diagnostic : found.all()) {
      if (diagnostic.severity != Severity::error) diagnostics.add(diagnostic);
    }
    throw;
  }
  find_ground(out);
  rename_ground(out, found);
  out.missing = files.missing();
  out.files = document.read_files();
  note_missing_systems(out, found);
  for (const Diagnostic& diagnostic : found.all()) diagnostics.add(diagnostic);
  return out;
}

}  // namespace

const SdfModel* SdfWorld::find(std::string_view name) const {
  const auto found =
      std::find_if(models.begin(), models.end(), [&](const SdfModel& m) { return m.name == name; });
  return found == models.end() ? nullptr : &*found;
}

SdfWorld load_sdf(const fs::path& given, PackageResolver& resolver, Diagnostics& diagnostics) {
  std::error_code none;
  fs::path file = given;
  if (fs::is_directory(given, none)) {
    file = model_file(given);
    if (file.empty()) {
      throw InputError("world.not_found", make_location(given.string()),
                       "the folder has no model.config that names an SDF file, and no model.sdf",
                       "give the SDF file itself");
    }
  }
  resolver.add_context(file);
  ModelSearch search(file, resolver);
  const fs::path folder = fs::absolute(file, none).lexically_normal().parent_path();
  if (lowered(file.extension().string()) == ".xacro") {
    ExpandedDescription expanded = expand_description(file, {}, resolver, diagnostics);
    SdfWorld out = read(std::move(expanded.root), file.string(), folder, &search, resolver, diagnostics);
    out.files.insert(out.files.begin(), expanded.files.begin(), expanded.files.end());
    return out;
  }
  SdfWorld out =
      read(read_file(file.string(), kMaxSdfBytes), file.string(), folder, &search, resolver, diagnostics);
  out.files.insert(out.files.begin(), file);
  return out;
}

SdfWorld parse_sdf(const std::string& text, const std::string& name, const fs::path& folder,
                   PackageResolver& resolver, Diagnostics& diagnostics) {
  if (folder.empty())
    return read(text, name, folder, static_cast<ModelSearch*>(nullptr), resolver, diagnostics);
  ModelSearch search(folder, resolver);
  return read(text, name, folder, &search, resolver, diagnostics);
}

SdfWorld parse_sdf(const std::string& text, const std::string& name, const SdfMeshFinder& find_mesh,
                   Diagnostics& diagnostics) {
  PackageResolver nothing;
  return read(text, name, {}, find_mesh, nothing, diagnostics);
}

bool is_sdf(const fs::path& file) {
  std::error_code none;
  std::string extension = lowered(file.extension().string());
  if (fs::is_directory(file, none)) return !model_file(file).empty();
  if (extension == ".xacro") extension = lowered(file.stem().extension().string());
  return extension == ".sdf" || extension == ".world" || extension == ".model";
}

ModelInstance make_instance(const SdfModel& model, const std::string& name, CollisionMeshes& meshes,
                            Diagnostics& diagnostics) {
  const auto compiled =
      std::make_shared<const Model>(compile_model(*model.description, model.base, diagnostics));
  InstanceOptions options;
  options.name = name.empty() ? model.name : name;
  options.self_collision = model.self_collide;
  options.passive = true;
  options.X_BO = model.X_RM;
  options.q0 = compiled->neutral();
  for (const auto& [joint, q] : model.positions) {
    const int index = compiled->find_joint(joint);
    if (index >= 0) options.q0[compiled->joints[static_cast<std::size_t>(index)].q] = q;
  }
  compiled->apply_mimics(options.q0);
  if (model.base == BaseKind::floating) {
    options.q0.head<3>() = model.X_WR.translation();
    options.q0.segment<4>(3) = Eigen::Quaterniond(model.X_WR.linear()).coeffs();  // x y z w
  } else {
    options.X_WR = model.X_WR;
  }
  return make_instance(model.description, compiled, options, meshes, diagnostics);
}

}  // namespace doppel
