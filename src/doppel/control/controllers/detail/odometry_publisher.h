#pragma once
// ~/odom (nav_msgs/msg/Odometry) and the transform odom -> base on /tf of a mobile base's controller, with
// the parameters of ros2_controllers' bases: odom_frame_id, base_frame_id, tf_frame_prefix, covariances,
// enable_odom_tf, publish_rate. Frames by REP 105.

#include <optional>
#include <string>
#include <vector>

#include "doppel/control/controllers/detail/controller_parameters.h"
#include "doppel/control/controllers/detail/planar_odometry.h"
#include "doppel/control/manager/controller.h"
#include "doppel/ros/messages/nav_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"

namespace doppel {

class OdometryPublisher {
 public:
  // The parameter tf_frame_prefix: empty stands for the controller's namespace (and tf_frame_prefix_enable:
  // false for no prefix), or for no prefix; or there is none.
  enum class FramePrefix { of_namespace, as_written, none };
  // The settings that differ between the controllers.
  struct Options {
    std::string odometry = "~/odom", transform = "/tf";            // topics
    std::vector<double> covariance = std::vector<double>(6, 0.0);  // default of both diagonals
    std::string pose_covariance = "pose_covariance_diagonal";      // parameters
    std::string twist_covariance = "twist_covariance_diagonal";
    FramePrefix prefix = FramePrefix::of_namespace;
    bool has_rate = true;         // publish_rate; else at each update
    bool has_only_twist = false;  // odom_only_twist: no pose in the odometry
    bool sends_transform = true;  // default of enable_odom_tf
  };
  // Declares the parameters and advertises the topics. Throws InputError for an invalid value.
  void declare(ControllerContext& context, const Options& options);
  // Between steps: reads the present values of the parameters; the next call of publish() is due.
  Status configure();
  // In the loop, at each update: publishes when it is due, at publish_rate.
  void publish(Time now, const PlanarOdometry& odometry);
  // The transform that publish() sends; nullptr: none.
  [[nodiscard]] const BaseTransform* base_transform() const { return sends_tf_ ? &base_transform_ : nullptr; }
  [[nodiscard]] const std::string& odometry_frame() const { return odometry_frame_; }  // without a prefix

  // When the last message was due.
  [[nodiscard]] const std::optional<Time>& last() const { return last_; }
  void set_last(std::optional<Time> last) { last_ = last; }

 private:
  ControllerParameters parameters();
  void report_base_frame(const ControllerContext& context) const;
  void report_transform_topic(const ControllerContext& context) const;
  [[nodiscard]] std::string frame_prefix() const;

  Node* node_ = nullptr;
  Publisher<nav_msgs::msg::Odometry> odometry_topic_;
  Publisher<tf2_msgs::msg::TFMessage> transform_topic_;
  nav_msgs::msg::Odometry odometry_;
  tf2_msgs::msg::TFMessage transform_;
  BaseTransform base_transform_;
  Options options_;
  bool has_prefix_ = true, sends_tf_ = true, only_twist_ = false;
  std::string prefix_, odometry_frame_ = "odom", base_frame_ = "base_link";
  std::vector<double> pose_covariance_, twist_covariance_;  // diagonals
  double rate_ = 50;                                        // Hz
  Duration period_{};
  std::optional<Time> last_;  // when the last message was due
};

}  // namespace doppel
