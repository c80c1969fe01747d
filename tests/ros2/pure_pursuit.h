#pragma once
// A navigator as Nav2 has them, with Fast DDS alone: takes a goal from goal_pose, as RViz sends it, follows the straight
// way there by pure pursuit (Coulter, Implementation of the Pure Pursuit Path Tracking Algorithm, CMU-RI-TR-92-01), and
// turns to the goal's heading. Its feedback is TF and odometry, its output TwistStamped with the odometry's stamps.

#include <geometry_msgs.h>
#include <nav_msgs.h>
#include <tf2_msgs.h>

#include <optional>
#include <string>

#include "fast_peer.h"

namespace doppel::ros2_testing {

struct PlanarPose {
  double x = 0, y = 0, yaw = 0;  // m, rad
};

class PurePursuit {
 public:
  struct Names {
    std::string odom_frame = "odom", base_frame = "base_footprint";
    std::string odometry = "rt/base_controller/odom", velocity = "rt/base_controller/cmd_vel";
  };
  PurePursuit(FastPeer& peer, Names names);

  [[nodiscard]] bool is_connected() const;
  // Handles what has arrived, and sends a velocity for each message of odometry. True: the goal that came last is reached,
  // and the base rests.
  bool update();
  // Of the base in the frame odom, from TF.
  [[nodiscard]] std::optional<PlanarPose> pose() const { return pose_; }
  [[nodiscard]] int commands() const { return commands_; }
  [[nodiscard]] int stale_transforms() const { return stale_transforms_; }  // stamps that do not increase

 private:
  void take_transforms();
  void take_goal();
  [[nodiscard]] geometry_msgs::msg::dds_::Twist_ velocity_to_goal();

  Names names_;
  Subscription<tf2_msgs::msg::dds_::TFMessage_> transforms_;
  Subscription<nav_msgs::msg::dds_::Odometry_> odometry_;
  Subscription<geometry_msgs::msg::dds_::PoseStamped_> goals_;
  Publisher<geometry_msgs::msg::dds_::TwistStamped_> velocity_;
  std::optional<PlanarPose> pose_, start_, goal_;
  double last_stamp_ = -1;
  bool is_near_ = false, arrived_ = false;
  int commands_ = 0, stale_transforms_ = 0;
};

PlanarPose planar(const geometry_msgs::msg::dds_::Point_& position,
                  const geometry_msgs::msg::dds_::Quaternion_& orientation);
double wrapped(double angle);  // to -pi ... pi

}  // namespace doppel::ros2_testing
