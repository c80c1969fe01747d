#pragma once
// All that surrounds a twin or a view while it is up: the server with what clients may fetch, ROS 2's
// network, the health of the descriptions, and reload on save.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "doppel/core/log.h"
#include "doppel/export.h"
#include "doppel/session/audit_result.h"
#include "doppel/session/health_publisher.h"
#include "doppel/session/reload.h"
#include "doppel/session/ros_edge.h"
#include "doppel/session/server_edge.h"
#include "doppel/twin/twin.h"
#include "doppel/twin/viewer.h"

namespace doppel {

struct SessionOptions {
  ServerEdgeOptions server;
  std::optional<ros2::ParticipantOptions> network;  // of ROS 2; nothing: not joined
  BundledFolders bundled;
  bool reload = true;  // edits of the sources are picked up
};

// On the loop's thread, all of it; the loop keeps running between the calls. Throws InputError: there is no
// port. What it is for, and `log`, have to outlive it.
class DOPPEL_API Session {
 public:
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  [[nodiscard]] const ServerEdge& server() const { return server_; }
  [[nodiscard]] const RosEdge& ros() const { return ros_; }
  // Where it can be reached, for people.
  [[nodiscard]] std::string banner() const { return server_.banner() + ros_.banner(); }

 protected:
  Session(Bus& bus, const std::string& name, const SessionOptions& options, const Log& log);
  ~Session() = default;

  std::shared_ptr<AssetLibrary> assets_;
  ServerEdge server_;
  RosEdge ros_;
  BundledFolders bundled_;
};

class DOPPEL_API TwinSession : public Session {
 public:
  TwinSession(Twin& twin, const SessionOptions& options, const Log& log);
  ~TwinSession();

  // After the first step: joins ROS 2's network and judges the descriptions.
  void begin();
  // The loop has ended: edits are not picked up any more.
  void end() { reloader_.reset(); }

 private:
  [[nodiscard]] RobotFiles files() const;
  void look();  // robots may have come and gone, or look different
  void let_go_of_gone();

  Twin& twin_;
  std::map<std::string, std::unique_ptr<HealthPublisher>> health_;  // by namespace
  std::optional<Reloader> reloader_;
};

class DOPPEL_API ViewSession : public Session {
 public:
  ViewSession(Viewer& viewer, const WorldRobot& robot, const SessionOptions& options, const Log& log);

  // Joins ROS 2's network.
  void begin() { ros_.open(); }

 private:
  void look();

  Viewer& viewer_;
  HealthPublisher health_;
  std::optional<Reloader> reloader_;
};

}  // namespace doppel
