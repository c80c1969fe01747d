#pragma once
// A robot without physics, to view a description: joints are at their commanded positions. Does the work of
// robot_state_publisher and joint_state_publisher: subscribes to /joint_command, publishes /joint_states, /tf
// and /robot_description, stamped with wall-clock time.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

class DOPPEL_API Viewer {
 public:
  // Uses the scenario's first robot's target and arguments, and bundled_robots. Errors that do not
  // affect the picture are warnings in `diagnostics` (twin/viewer/detail/drawable.h); throws InputError if nothing
  // can be drawn. `log`, which outlives the viewer, gets later messages: invalid commands, each once.
  Viewer(const Scenario& scenario, const Log& log, Diagnostics& diagnostics);
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  // -- the loop's thread
  // One frame, at 60 Hz: handles messages of edges and publishes changes, and the whole state at 10 Hz.
  // `now`: wall-clock time since the epoch.
  void step(Time now);

  // -- reload of the sources, as in a twin (twin/assembly/twin.h)
  struct Replacement;
  // The input of prepare(), which may outlive the viewer. The loop's thread.
  [[nodiscard]] std::shared_ptr<const Scenario> scenario() const;
  // On any thread. Throws InputError if the files cannot be used.
  [[nodiscard]] static std::shared_ptr<Replacement> prepare(const Scenario& scenario,
                                                            Diagnostics& diagnostics);
  // The loop's thread. Joints of the same name and type keep their positions, clamped to the new limits.
  void replace(const std::shared_ptr<Replacement>& replacement);
  // The description of a replacement, before replace().
  [[nodiscard]] static const RobotDescription& description(const Replacement& replacement);
  [[nodiscard]] static const ExpandedDescription& expanded(const Replacement& replacement);
  // All files from which the picture was made. The loop's thread.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;

  [[nodiscard]] const Model& model() const;
  [[nodiscard]] const RobotDescription& description() const;
  [[nodiscard]] const ExpandedDescription& expanded() const;
  [[nodiscard]] const Eigen::VectorXd& q() const;  // [model().nq] rad, m
  [[nodiscard]] Bus& bus();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
