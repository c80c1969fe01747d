#pragma once
// The state of a robot that a client needs before and while it moves joints: positions, the model, the
// emergency stop.

#include <limits>
#include <map>
#include <optional>
#include <string>

#include "app/verbs/shell.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel::app {

using Positions = std::map<std::string, double>;  // by joint: rad or m

struct JointSample {
  double position = std::numeric_limits<double>::quiet_NaN();  // rad or m
  double velocity = std::numeric_limits<double>::quiet_NaN();  // rad/s or m/s; NaN: not measured
  double effort = std::numeric_limits<double>::quiet_NaN();    // N m or N; NaN: not measured
};

// The drive of a joint as a twin publishes it; robots without the topic have only joint_states.
struct DriveLoad {
  double effort = std::numeric_limits<double>::quiet_NaN(), limit = std::numeric_limits<double>::infinity();
};

class RobotWatch {
 public:
  // Subscribes to the topics in the manager's namespace, and waits for a state, the description and the stop.
  // Throws ClientError if no joint states arrive, or the description is another robot's.
  RobotWatch(Client& twin, const std::string& manager);

  // Uses a received message; false: it is of another topic than the joint states. Throws ClientError where
  // the description lacks a joint of the states.
  bool take(const Client::Received& message);

  [[nodiscard]] const std::map<std::string, JointSample>& joints() const { return joints_; }
  // nullopt: joint_states does not contain the joint.
  [[nodiscard]] std::optional<double> position(const std::string& joint) const;
  // The stamp of the last state: simulated time, where the twin stamps by it.
  [[nodiscard]] Time stamp() const { return stamp_; }
  // nullptr: no description is published, or it cannot be read.
  [[nodiscard]] const Model* model() const { return model_ ? &*model_ : nullptr; }
  // The joint in the model; nullptr: it, or the model, does not exist.
  [[nodiscard]] const ModelJoint* find(const std::string& joint) const;
  // The drive's effort and its limit; NaN: not known.
  [[nodiscard]] DriveLoad load(const std::string& joint) const;
  [[nodiscard]] bool is_stopped() const { return stopped_.value_or(false); }

 private:
  void read_description(const std::string& urdf);
  void check_description() const;

  std::string states_, description_, stop_, loads_topic_;  // topics
  std::map<std::string, JointSample> joints_;
  std::map<std::string, DriveLoad> loads_;
  Time stamp_{};
  std::optional<Model> model_;
  bool description_came_ = false;
  std::optional<bool> stopped_;  // nullopt: not published
};

}  // namespace doppel::app
