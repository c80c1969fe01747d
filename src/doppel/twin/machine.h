#pragma once
// What a scenario's files make before anything is on the bus: description, model, engine, controllers' YAML.
// Built on any thread, so that an edit is judged while the old machine runs on.

#include <memory>
#include <optional>
#include <vector>

#include "doppel/physics/engine.h"
#include "doppel/twin/robot_setup.h"

namespace doppel {

struct Machine {
  // Throws InputError. `running`: how the base stands of the machine that this one is to replace.
  Machine(const Scenario& scenario, Diagnostics& diagnostics, std::optional<BaseKind> running = std::nullopt);
  // How the root link stands.
  [[nodiscard]] BaseKind base() const;
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  // Gravity in the axes of the robot's root link, m/s^2.
  [[nodiscard]] Eigen::Vector3d gravity_R() const;
  // Every file that it was made of: the description's, the controllers', the world's, the meshes.
  [[nodiscard]] std::vector<std::filesystem::path> files(const Scenario& scenario) const;

  PackageResolver resolver;
  RobotSetup setup;
  Model model;
  std::vector<HardwareDescription> hardware;  // the description's, or one made up
  std::vector<ServoParameters> servos;        // [joints]
  std::unique_ptr<Engine> engine;
};

// Whether controllers made for `a` can go on with `b`: the same links, joints, interfaces, controllers' YAML
// and step; limits, inertia, geometry and places may differ.
bool same_structure(const Machine& a, const Machine& b);

// Throws InputError where a joint that stands within its limits in `from` would stand outside of them in
// `to`, would lose its whole range, or where what is written of its <mimic> or axis would have no effect any
// more: a slip of the pen must not drive a machine that runs.
void refuse_lost_range(const Machine& from, const Machine& to);

// Time, the state and drives' references of every joint with the same name and type, the poses and velocities
// of objects, those that were put in while the machine ran, and without those that were deleted. Throws
// InputError where an object that was put in cannot be used any more.
void carry_over_state(const Machine& from, Machine& to);

}  // namespace doppel
