#pragma once
// SDF files, worlds and models, versions 1.3 to 1.11, read with the place of every element. Poses are resolved,
// included models are read from this machine (detail/model_search.h), and every tree of links is a RobotDescription, so
// that everything that uses a URDF works on it. Source: the SDFormat specification 1.11 (sdformat.org/spec) and its
// proposal "Pose frame semantics".
//
// Rules: "sdf.unknown_element", "sdf.no_effect" and "sdf.sensor_system" are notes, "sdf.missing_model" a warning; "sdf.duplicate_name",
// "sdf.unknown_frame", "sdf.frame_cycle", "sdf.value" and "sdf.not_sdf" are errors.

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/math/geodesy.h"
#include "doppel/base/packages/package_resolver.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/physics/contract/model_instance.h"
#include "doppel/physics/contract/world.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

struct SdfSensor {
  std::string name, type;        // "camera"
  std::string link;              // of the description; of a joint's sensor the joint's child
  Pose X_LS = Pose::Identity();  // the sensor in the link
  std::string joint;             // of a joint's sensor; else empty
  XmlNode node;                  // the whole element, with places
  SourceLocation source;
};

struct SdfFrame {
  std::string name, link;        // the link of the description that it is attached to
  Pose X_LF = Pose::Identity();  // in the link
};

// Links that joints connect: one tree, and the base that it stands on. Most models of SDF are one; a model whose
// links are not all connected is several, named "model" and "model::link", and models that a joint of the world
// connects are one, with the names of the first.
struct SdfModel {
  std::string name;                                     // unique in its world
  std::shared_ptr<const RobotDescription> description;  // links of nested models: "inner::link"
  BaseKind base = BaseKind::floating;                   // fixed: static, or joined to the world
  bool is_static = false;
  bool self_collide = false;
  Pose X_WR = Pose::Identity();  // the root link in the world, or in the model's file
  Pose X_RM = Pose::Identity();  // the model's frame in the root link
  // Scalar joints that <state> gives another position than zero: rad, m.
  std::vector<std::pair<std::string, double>> positions;
  std::vector<SdfSensor> sensors;
  std::vector<SdfFrame> frames;
  SourceLocation source;
};

struct DOPPEL_API SdfWorld {
  // ground: a static horizontal plane at z = 0 was found; friction_rule: the smaller; with lights and environment.
  WorldSettings settings;
  EarthFrame earth;       // of <spherical_coordinates> and <magnetic_field>
  bool is_world = false;  // false: a file with models only, with gravity and a ground
  std::string version;    // of SDF, as written
  std::vector<SdfModel> models;
  std::vector<GazeboPlugin> plugins;         // of the world
  std::vector<std::filesystem::path> files;  // that were read, without meshes; the first is the file itself
  std::vector<std::string> missing;  // URIs of models and meshes that were not found, in order, once each

  [[nodiscard]] const SdfModel* find(std::string_view name) const;
};

// Reads a world or model file, or the model of a folder. Notes and warnings go to `diagnostics`. Throws InputError
// with every error found. Any thread, with a resolver of its own.
DOPPEL_API SdfWorld load_sdf(const std::filesystem::path& file, PackageResolver& resolver,
                             Diagnostics& diagnostics);
// The same for text. `name` is used as the file in messages; relative URIs start at `folder`. Without a `folder`
// no file is read: models and meshes are searched nowhere.
DOPPEL_API SdfWorld parse_sdf(const std::string& text, const std::string& name,
                              const std::filesystem::path& folder, PackageResolver& resolver,
                              Diagnostics& diagnostics);
// The same for text whose meshes are found by a function, which throws InputError; no model is included.
using SdfMeshFinder = std::function<std::filesystem::path(const std::string& uri)>;
DOPPEL_API SdfWorld parse_sdf(const std::string& text, const std::string& name,
                              const SdfMeshFinder& find_mesh, Diagnostics& diagnostics);

// True if it is an SDF file by its name: .sdf, .world, .model, these with .xacro behind them (which is
// expanded with the defaults of its arguments), or a folder with a model.config.
DOPPEL_API bool is_sdf(const std::filesystem::path& file);

// The file of a world's or model's name as the command line gives it: a file, a folder, a name on the
// search path, or that of a bundled world, with or without "worlds/" and extension. A name without an
// extension is a YAML file before an SDF file, or the other way round if `sdf_first`. Throws InputError
// "world.not_found" with the nearest names.
DOPPEL_API std::filesystem::path find_world(const std::string& name, PackageResolver& resolver,
                                            bool sdf_first = false);

// A world that comes with doppel.
struct BundledWorld {
  std::filesystem::path file;
  std::string about;  // the first sentence of its first comment
};
// Sorted by file name; empty without an installation's or a checkout's data.
DOPPEL_API std::vector<BundledWorld> bundled_worlds();

// The instance of a model in an engine, without drives. `name`: another name; empty: the model's.
DOPPEL_API ModelInstance make_instance(const SdfModel& model, const std::string& name,
                                       CollisionMeshes& meshes, Diagnostics& diagnostics);

}  // namespace doppel
