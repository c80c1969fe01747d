#pragma once
// Everything around a running twin or view: the server with the files that clients may fetch, the ROS 2
// network, the health of the descriptions, and reload on save.

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/lab/recording/run_recording.h"
#include "doppel/ros/camera_feed/camera_feed.h"
#include "doppel/ros/record/bag_reader.h"
#include "doppel/ros/record/bus_recorder.h"
#include "doppel/session/live/audit_result.h"
#include "doppel/session/live/black_box.h"
#include "doppel/session/live/calibration_service.h"
#include "doppel/session/live/health_publisher.h"
#include "doppel/session/live/reload.h"
#include "doppel/session/live/resource_service.h"
#include "doppel/session/live/ros_edge.h"
#include "doppel/session/live/server_edge.h"
#include "doppel/session/live/validation_service.h"
#include "doppel/twin/assembly/twin.h"
#include "doppel/twin/viewer/viewer.h"

namespace doppel {

struct SessionOptions {
  ServerEdgeOptions server;
  std::optional<ros2::ParticipantOptions> network;        // of ROS 2; nullopt: not joined
  ros2::Yielding move_group = ros2::Yielding::to_others;  // its services on that network
  BundledFolders bundled;
  bool reload = true;                              // reload when a source file is saved
  bool rewind = true;                              // of a twin: keep automatic states (twin/saved_states)
  std::optional<RunRecordingOptions> record = {};  // of a twin, from the first step on
  std::optional<BlackBoxOptions> black_box = {};   // of a twin
  std::optional<CameraFeedOptions> cameras = {};   // of a twin
  LoadValidation validation = {};                  // of a twin; empty: its services are not offered
  Scenario scenario = {};                          // of a twin that is validated
};

// All functions: the loop's thread; the loop keeps running between the calls. Constructors throw InputError
// if no port is available. The twin or viewer and `log` outlive the session.
class DOPPEL_API Session {
 public:
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  [[nodiscard]] const ServerEdge& server() const { return server_; }
  [[nodiscard]] const RosEdge& ros() const { return ros_; }
  // Lines with the addresses, for the terminal; that of the page is the last one of a start.
  [[nodiscard]] std::string banner() const { return server_.banner() + ros_.banner(); }
  [[nodiscard]] std::string page_line() const { return server_.page_line(); }

 protected:
  Session(Bus& bus, const std::string& name, const SessionOptions& options, const Log& log);
  ~Session() = default;

  std::shared_ptr<AssetLibrary> assets_;
  ResourceService resources_;
  ServerEdge server_;
  RosEdge ros_;
  BundledFolders bundled_;
};

class DOPPEL_API TwinSession : public Session {
 public:
  // Throws InputError, too, where a running twin of this user has the names of the nodes on the network.
  TwinSession(Twin& twin, const SessionOptions& options, const Log& log);
  ~TwinSession();

  // After the first step: joins the ROS 2 network and starts the audit of the descriptions.
  void begin();
  // After the end of the loop: edits have no effect any more, and the recording is closed.
  void end();
  // nullptr: nothing is recorded.
  [[nodiscard]] BusRecorder* recorder() { return recorder_ ? &*recorder_ : nullptr; }

 private:
  [[nodiscard]] RobotFiles files() const;
  void start_recording(RunRecordingOptions options, bool rewind);
  void start_black_box(BlackBoxOptions options, bool rewind);
  [[nodiscard]] ValidatedRobot validated(const std::string& name_space) const;
  [[nodiscard]] std::vector<CalibratedRobot> calibrated() const;
  [[nodiscard]] double measured(const std::string& name_space, const std::string& joint) const;
  void update_audits();  // robots may have been added, removed or changed
  void remove_stale_publishers();
  std::unique_ptr<HealthPublisher> make_publisher(const WorldRobot& robot);

  Twin& twin_;
  const Log& log_;
  std::map<std::string, std::unique_ptr<HealthPublisher>> health_;  // by namespace
  std::vector<std::unique_ptr<HealthPublisher>> retired_;  // of deleted robots, until their audits end
  std::optional<Reloader> reloader_;
  std::optional<BusRecorder> recorder_;
  std::optional<BlackBox> black_box_;
  std::optional<CameraFeed> cameras_;
  Scenario scenario_;
  std::optional<ValidationService> validation_;
  std::optional<CalibrationService> calibration_;  // of arms that are devices
};

class DOPPEL_API ViewSession : public Session {
 public:
  ViewSession(Viewer& viewer, const WorldRobot& robot, const SessionOptions& options, const Log& log);

  // Joins ROS 2's network.
  void begin() { ros_.open(); }

 private:
  void update_audit();

  Viewer& viewer_;
  HealthPublisher health_;
  std::optional<Reloader> reloader_;
};

// A recording that is played on a bus; its meshes are those that it has as attachments.
class DOPPEL_API BagSession : public Session {
 public:
  BagSession(Bus& bus, const std::string& name, BagReader& bag, const SessionOptions& options,
             const Log& log);
  ~BagSession();

  // Joins ROS 2's network.
  void begin() { ros_.open(); }
  [[nodiscard]] PlaybackControl& playback() { return *playback_; }

 private:
  BagSession(std::shared_ptr<PlaybackControl> playback, Bus& bus, const std::string& name, BagReader& bag,
             SessionOptions options, const Log& log);

  std::shared_ptr<PlaybackControl> playback_;  // Foxglove's controls
  std::filesystem::path meshes_;               // a folder that is removed at the end; empty: there are none
};

}  // namespace doppel
