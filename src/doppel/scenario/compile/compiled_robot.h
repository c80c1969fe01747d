#pragma once
// A robot's files, compiled before anything is on the bus: description, controllers' YAML, model, hardware,
// and the instance for the engine. Immutable once it is built, so that threads share it.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/physics/contract/world.h"
#include "doppel/scenario/compile/base_choice.h"
#include "doppel/scenario/compile/robot_sensors.h"
#include "doppel/scenario/compile/robot_setup.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel {

class DOPPEL_API CompiledRobot {
 public:
  // Throws InputError. Any thread. `running`: the type of base of the robot that this one replaces.
  CompiledRobot(const WorldRobot& asked, const Scenario& scenario, const World& world,
                std::optional<BaseKind> running, PackageResolver& resolver, CollisionMeshes& meshes,
                Diagnostics& diagnostics);
  // From a description in memory, without a file, so that it is not reloaded. Throws InputError.
  CompiledRobot(const WorldRobot& asked, const Scenario& scenario, const World& world,
                RobotDescription description, CollisionMeshes& meshes, Diagnostics& diagnostics);

  // A model of an SDF file, under its instance's name. Throws InputError: no plugin of it is mapped.
  CompiledRobot(const WorldRobot& asked, const Scenario& scenario, const World& world, const SdfModel& model,
                const std::string& name, CollisionMeshes& meshes, Diagnostics& diagnostics);

  // Reports choices made on the user's behalf, with the height of a floating base in `instance`. Called once,
  // before the machine is shared.
  void report_choices(const Instance& instance, Diagnostics& diagnostics);

  [[nodiscard]] const WorldRobot& asked() const { return asked_; }
  [[nodiscard]] const std::string& name_space() const { return asked_.name_space; }  // "left"
  [[nodiscard]] const std::string& name() const { return made_.name; }               // of its instance
  [[nodiscard]] const RobotSetup& setup() const { return *setup_; }
  [[nodiscard]] const RobotDescription& description() const { return setup_->description.robot; }
  [[nodiscard]] const Model& model() const { return *made_.model; }
  [[nodiscard]] const std::shared_ptr<const Model>& shared_model() const { return made_.model; }
  [[nodiscard]] const ModelInstance& instance() const { return made_; }
  [[nodiscard]] const std::vector<ServoParameters>& servos() const { return made_.servos; }  // [joints]
  [[nodiscard]] const std::vector<HardwareDescription>& hardware() const { return hardware_; }
  [[nodiscard]] const std::optional<RobotChoices>& choices() const { return choices_; }  // of the scenario
  // Simulated interfaces of all joints instead of the description's.
  [[nodiscard]] bool has_generated_hardware() const { return generated_hardware_; }
  [[nodiscard]] const RobotSensors& sensors() const { return sensors_; }
  [[nodiscard]] BaseKind base() const { return base_.kind; }
  // It was sent to a service, so that no file is read again.
  [[nodiscard]] bool from_text() const { return asked_.target.empty() && asked_.model.empty(); }
  // In the axes of the root link, m/s^2.
  [[nodiscard]] const Eigen::Vector3d& gravity_R() const { return gravity_R_; }
  // The files of the description and the controllers, and the meshes.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;

 private:
  void make_hardware(Diagnostics& diagnostics);
  void build(const Scenario& scenario, const World& world, std::optional<BaseKind> running, RobotSetup& setup,
             CollisionMeshes& meshes, Diagnostics& diagnostics);

  WorldRobot asked_;
  std::optional<RobotChoices> choices_;
  std::shared_ptr<const RobotSetup> setup_;
  BaseChoice base_;
  bool base_decided_ = false;  // by the user or the replaced machine
  Eigen::Vector3d gravity_R_ = Eigen::Vector3d::Zero();
  ModelInstance made_;
  RobotSensors sensors_;
  bool generated_hardware_ = false;
  std::vector<HardwareDescription> hardware_;  // the description's, or a generated one
};

// True if controllers made for `a` can continue with `b`: the same links, joints, interfaces and controllers'
// YAML; limits, inertia, geometry and poses may differ.
DOPPEL_API bool same_structure(const CompiledRobot& a, const CompiledRobot& b);

}  // namespace doppel
