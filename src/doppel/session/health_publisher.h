#pragma once
// /doppel/health: what `doppel check --json` says of the robot that is up; /doppel/sources: where its links
// and joints are written. Both latched, made on a thread of its own, because reading every mesh takes its
// time.

#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/core/source_location.h"
#include "doppel/description/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// Where each link and joint of a robot is written.
struct SourcePlaces {
  using Named = std::pair<std::string, SourceLocation>;
  std::vector<Named> links, joints;
};
DOPPEL_API SourcePlaces source_places(const RobotDescription& robot);

// {"links": {NAME: {"file", "shown", "line", "column", "stack": [{"what", "file", "line", "column"}...]}},
//  "joints": {...}}: files absolute, `shown` as messages tell them, `stack` the macros and includes that led
// there, outermost first.
DOPPEL_API std::string to_json(const SourcePlaces& places);

class DOPPEL_API HealthPublisher {
 public:
  // The loop's thread. name_space: the robot's ("left"), before the topics. `judge` makes the text of
  // /doppel/health, on this publisher's thread; it may go on after the publisher has ended, so it owns what
  // it needs.
  HealthPublisher(Bus& bus, const std::string& name_space, std::function<std::string()> make_report);
  // A judgement that takes long (a mesh of a million triangles) is left behind; see process.h.
  ~HealthPublisher();
  HealthPublisher(const HealthPublisher&) = delete;
  HealthPublisher& operator=(const HealthPublisher&) = delete;

  // The loop's thread: `robot` is what runs (now). Runs the audit again and publishes both.
  void look_at(const RobotDescription& robot);

 private:
  struct Publishers;
  struct SharedState;
  std::shared_ptr<Publishers> publishers_;
  std::shared_ptr<SharedState> shared_;  // with the thread
  std::thread thread_;
};

}  // namespace doppel
