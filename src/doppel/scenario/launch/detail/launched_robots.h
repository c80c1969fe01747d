#pragma once
// The robots of a launch file: descriptions, spawned models, controllers and the world, collected in the
// order of
// the file and put together at its end.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/scenario/launch/detail/spawn_arguments.h"
#include "doppel/scenario/launch/launch_plan.h"

namespace doppel {

// A description under the name of its parameter, "left/robot_description" for a robot in /left.
struct LaunchedDescription {
  std::string parameter = {};  // its full name
  std::string name_space = {};
  LaunchedRobotText robot = {};
  SourceLocation source = {};
  std::string frame_prefix = {};
  bool separate_tf = false;
  bool spawned = false;
  std::optional<Pose> X_WR = {};
};

// "left" of "left/robot_description".
std::string namespace_of_name(const std::string& full_name);

class LaunchedRobots {
 public:
  // `description`: the launch file, which outlives it.
  LaunchedRobots(const LaunchDescription& description, PackageResolver& resolver,
                 std::filesystem::path folder)
      : made_files_(description.made_files), resolver_(resolver), folder_(std::move(folder)) {}

  // The first description of a parameter counts. The reference lasts until the next call.
  LaunchedDescription& add_description(const std::string& name_space, const LaunchedRobotText& robot,
                                       const SourceLocation& source, std::string parameter = "");
  // Parts of a robot are there, whichever file loads its description.
  void need_description() { uses_description_ = true; }
  void add_manager(const std::string& name_space, std::vector<std::filesystem::path> files);
  // `name_space`: of the spawner, where it does not name the manager.
  void add_spawned(const ControllerSpawn& spawn, const std::string& name_space);
  void spawn(ModelSpawn model, const std::string& name_space, const SourceLocation& source);
  void use_simulator(const SourceLocation& source, const std::string& world);
  void add_ros1_file(const std::string& name, const std::filesystem::path& file) {
    ros1_files_.emplace_back(name, file);
  }
  [[nodiscard]] bool has_simulator() const { return simulator_; }

  // Robots, world and controllers of the scenario.
  void finish(LaunchPlan& plan);
  // A file in the launch's folder.
  [[nodiscard]] std::filesystem::path written(const std::string& name, const std::string& text) const;

 private:
  struct SpawnedFile {
    std::string uri, name;
    Pose X_WM = Pose::Identity();
  };
  // A model by the topic or parameter of its description.
  struct Spawn {
    std::string parameter, name;
    std::optional<Pose> X_WR;
  };
  struct Manager {
    std::string name_space;
    std::vector<std::filesystem::path> files;
  };
  struct Spawned {
    std::string name_space;
    std::vector<std::string> active;
    std::vector<std::filesystem::path> files;
  };

  [[nodiscard]] LaunchedRobotText text_with_source(const ModelSpawn& model) const;
  void match_spawns();
  void take_sdf_descriptions();
  void choose_physics(LaunchPlan& plan);
  void add_robot(const LaunchedDescription& one, LaunchPlan& plan) const;
  void choose_world(LaunchPlan& plan);
  [[nodiscard]] std::filesystem::path world_with_models(
      const std::optional<std::filesystem::path>& world) const;
  void add_controllers(LaunchPlan& plan) const;
  [[nodiscard]] bool is_substituted(const std::filesystem::path& file) const;
  [[nodiscard]] std::vector<std::filesystem::path> ros1_controllers(const std::string& name_space) const;

  const std::vector<std::pair<std::filesystem::path, std::filesystem::path>>& made_files_;
  PackageResolver& resolver_;
  std::filesystem::path folder_;
  std::vector<LaunchedDescription> described_;
  std::vector<Spawn> spawns_;
  std::vector<SpawnedFile> files_;
  std::vector<Manager> managers_;
  std::vector<Spawned> spawned_;
  std::vector<std::pair<std::string, std::filesystem::path>> ros1_files_;
  std::string world_;
  SourceLocation world_source_;
  bool simulator_ = false, uses_description_ = false;
};

}  // namespace doppel
