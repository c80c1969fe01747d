#pragma once
// /doppel/health: the output of `doppel check --json` for the running robot; /doppel/sources: the source
// locations of its links and joints. Both are latched and made on a separate thread, because reading every
// mesh takes long.

#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"

namespace doppel {

// The source location of each link and joint of a robot.
struct SourcePlaces {
  using Named = std::pair<std::string, SourceLocation>;
  std::vector<Named> links, joints;
};
DOPPEL_API SourcePlaces source_places(const RobotDescription& robot);

// {"links": {NAME: {"file", "shown", "line", "column", "stack": [{"what", "file", "line", "column"}...]}},
//  "joints": {...}}: files absolute, `shown` as in messages, `stack` the macros and includes that led
// there, outermost first.
DOPPEL_API std::string to_json(const SourcePlaces& places);

class DOPPEL_API HealthPublisher {
 public:
  // The loop's thread. name_space: the robot's ("left"), prefix of the topics. `make_report` makes the text
  // of /doppel/health on this publisher's thread; it may still run after the publisher is destroyed, so it
  // must own everything that it uses. `on_published` is called on the loop's thread after each report; not
  // after the end of this publisher.
  HealthPublisher(Bus& bus, const std::string& name_space, std::function<std::string()> make_report,
                  std::function<void()> on_published = {});
  // Does not wait for a long audit (a mesh of a million triangles); see abandoned_thread.h.
  ~HealthPublisher();
  HealthPublisher(const HealthPublisher&) = delete;
  HealthPublisher& operator=(const HealthPublisher&) = delete;

  // The loop's thread: ends the topics and further audits without waiting for the present one. The
  // destructor does not wait once has_ended() is true.
  void retire();
  [[nodiscard]] bool has_ended() const;

  // The loop's thread: runs the audit again for the running `robot` and publishes both topics.
  void look_at(const RobotDescription& robot);

 private:
  struct Publishers;
  struct SharedState;
  std::shared_ptr<Publishers> publishers_;
  std::shared_ptr<SharedState> shared_;  // with the thread
  std::thread thread_;
};

}  // namespace doppel
