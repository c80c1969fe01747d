#pragma once
// The loop's status, in wall-clock time, also while simulated time is paused: /doppel/status
// (doppel_msgs/msg/TwinStatus, latched, 4 Hz and at every change) and, for the tools of ROS 2, /diagnostics
// (diagnostic_msgs/msg/DiagnosticArray, 1 Hz).

#include <chrono>
#include <memory>
#include <span>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/twin/loop/loop_meter.h"

namespace doppel {

struct RunStatistics;
struct TimeControl;
class TwinRobot;

class DOPPEL_API StatusPublisher {
 public:
  using WallTime = std::chrono::steady_clock::time_point;

  // `robot`: its name, the diagnostics' hardware id.
  StatusPublisher(Bus& bus, std::string robot, WallTime now);

  // The current status.
  struct Loop {
    Time time{};  // simulated
    std::uint64_t steps = 0;
    const TimeControl& control;
    const LoopMeter& meter;
    const RunStatistics& run;
    std::span<const std::unique_ptr<TwinRobot>> robots{};
  };
  // Called often on the loop's thread, between steps: publishes what is due. Costs a
  // few comparisons otherwise.
  void publish_due(const Loop& loop, WallTime now);

 private:
  void publish_status(const Loop& loop, WallTime now);
  void publish_diagnostics(const Loop& loop);

  Bus& bus_;
  Node node_;
  Publisher<doppel_msgs::msg::TwinStatus> status_topic_;
  Publisher<diagnostic_msgs::msg::DiagnosticArray> diagnostics_topic_;
  const WallTime begin_;
  WallTime next_status_, next_diagnostics_;
  doppel_msgs::msg::TwinStatus status_;  // as published last
  Time last_time_{};                     // an earlier time means a reset
  std::string robot_;
  std::uint64_t overruns_reported_ = 0;
};

}  // namespace doppel
