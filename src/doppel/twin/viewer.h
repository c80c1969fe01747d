#pragma once
// A robot without physics: joints stand where they are told to. What robot_state_publisher and
// joint_state_publisher do together, for looking at a description: /joint_command in, /joint_states, /tf and
// /robot_description out, stamped with wall time.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/core/diagnostic.h"
#include "doppel/core/log.h"
#include "doppel/export.h"
#include "doppel/twin/scenario.h"

namespace doppel {

class DOPPEL_API Viewer {
 public:
  // Of the scenario: the first robot's target and arguments, bundled_robots, inspect. Whatever can be drawn
  // is taken, with warnings in `diagnostics` (twin/detail/drawable.h); throws InputError where nothing can
  // be. `log`, which outlives the viewer, gets what is said later: commands that make no sense, each once.
  Viewer(const Scenario& scenario, const Log& log, Diagnostics& diagnostics);
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  // -- the loop's thread
  // One frame, 60 of them a second: takes what edges sent; publishes what changed, and all of it ten times a
  // second. `now`: wall time since the epoch.
  void step(Time now);

  // -- reload of the sources, as a twin's (twin/twin.h)
  struct Replacement;
  // On any thread. Throws InputError where the files cannot be used.
  [[nodiscard]] std::shared_ptr<Replacement> prepare(Diagnostics& diagnostics) const;
  // The loop's thread. Joints of the same name and kind stay where they are, inside their limits of now.
  void replace(const std::shared_ptr<Replacement>& replacement);
  // What it is made of, before it takes over.
  [[nodiscard]] static const RobotDescription& description(const Replacement& replacement);
  // Every file that the picture was made of. The loop's thread.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;

  [[nodiscard]] const Model& model() const;
  [[nodiscard]] const RobotDescription& description() const;
  [[nodiscard]] const Eigen::VectorXd& q() const;  // [model().nq]
  [[nodiscard]] Bus& bus();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
