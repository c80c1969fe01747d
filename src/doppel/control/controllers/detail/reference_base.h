#pragma once
// The common parts of the controllers of bases with ~/reference (geometry_msgs/msg/TwistStamped): mecanum and
// the steering controllers of ros2_controllers. A reference is valid for reference_timeout, and without one the wheels
// are commanded to stop; with a time-out of zero a reference is used in one update. ~/odometry and ~/tf_odometry
// are published at each update.

#include <optional>
#include <string>
#include <vector>

#include "doppel/control/controllers/detail/odometry_publisher.h"
#include "doppel/control/controllers/detail/planar_odometry.h"
#include "doppel/control/controllers/detail/twist_command.h"
#include "doppel/control/manager/controller.h"

namespace doppel {

class ReferenceBase : public Controller {
 public:
  Status on_activate() override;
  Status on_deactivate() override;
  void update(Time now, Duration period) final;
  void housekeeping(Time now) override;
  void set_chained_mode(bool chained) override;
  [[nodiscard]] const BaseTransform* base_transform() const override { return publisher_.base_transform(); }

 protected:
  // The parameters, topics and references of every such base. `timeout`: default of reference_timeout, s.
  void declare_base(ControllerContext& context, double timeout, const OdometryPublisher::Options& odometry);
  Status configure_base(std::size_t window);

  // In the loop. The references as a velocity; nullopt: there is none.
  [[nodiscard]] virtual std::optional<PlanarVelocity> reference() const = 0;
  virtual void write_reference(const geometry_msgs::msg::Twist& twist) = 0;  // NaN: none
  virtual void measure(const std::optional<PlanarVelocity>& reference, double dt) = 0;
  virtual void command(const PlanarVelocity& reference, double dt) = 0;
  virtual void stop_wheels() = 0;
  void publish_state(Time now) override = 0;
  virtual void rest() {}  // forgets the history of limiters

  ControllerContext* context_ = nullptr;
  PlanarOdometry odometry_;

 private:
  void take_reference(Time now);
  void clear_reference();

  OdometryPublisher publisher_;
  TwistCommand command_;
  bool active_ = false, chained_ = false, uses_once_ = false;
};

// The joint of a parameter, checked to be driven; `parameter` is a string or a list. Throws InputError.
std::vector<std::string> declare_driven_joints(ControllerContext& context, const std::string& parameter,
                                               const std::vector<std::string>& names);
[[noreturn]] void refuse_base_parameter(const ControllerContext& context, const std::string& parameter,
                                        const std::string& why, const std::string& fix);

}  // namespace doppel
