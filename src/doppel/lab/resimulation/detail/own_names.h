#pragma once
// The names of a twin's own topics and services in a run, by the rules of its --ros-args: "~/snapshot" is
// /second/doppel/snapshot where the run has the rule __ns:=/second.

#include <set>
#include <string>
#include <vector>

#include "doppel/ros/bus/bus.h"

namespace doppel {

// Services of what is around a twin: recorders, validations, measurements, files. They do not act on the run
// (the overlay that a calibration writes is an edit), and the repeated run does not offer them.
class ServicesAround {
 public:
  explicit ServicesAround(NameRules& rules);
  [[nodiscard]] bool has(const std::string& service) const;

 private:
  std::set<std::string> names_;
  std::vector<std::string> folders_;  // "/rosbag2_recorder/": the services whose names begin so
};

// Topics whose messages depend on the wall clock, or on other threads.
std::vector<std::string> topics_of_wall_clock(NameRules& rules);

}  // namespace doppel
