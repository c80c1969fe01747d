#pragma once
// The state of a running twin at one instant, for people and for machines.

#include <optional>
#include <string>
#include <vector>

#include "doppel/control/manager/controller_manager.h"
#include "doppel/twin/assembly/runner.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel::app {

// With several robots, joints and controllers are named with their scope: "left::Revolute 1".
struct Snapshot {
  Time now{};
  std::vector<JointSnapshot> joints;
  std::vector<ControllerView> controllers;
  bool stopped = false;  // the emergency stop is on
};

// The loop's thread, between steps.
Snapshot take_snapshot(Twin& twin);

// The summary that --json prints: one JSON object, version 1. With several robots it has "robots" too.
struct Summary {
  std::string robot, engine;
  double startup_ms = 0;
  RunStatistics run;
  std::uint64_t state_hash = 0;
  Snapshot last;
  struct Robot {
    std::string name;
    std::optional<RestReport> rest = {};
    std::string rest_reason = {};   // why there is none, or why it is not complete; empty: it is complete
    std::optional<Pose> X_WB = {};  // the root of a floating robot in the world
    std::uint64_t state_hash = 0;
  };
  std::vector<Robot> robots;
  std::vector<OscillationReport> oscillations;
  struct Sensor {
    std::string name;
    std::uint64_t samples = 0, left_out = 0;
    std::uint64_t hash = 0;  // over all that it published
  };
  std::vector<Sensor> sensors;
};
std::string to_json(const Summary& summary);

}  // namespace doppel::app
