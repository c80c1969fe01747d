#include "doppel/control/controllers/detail/reference_base.h"

#include <fmt/format.h>

#include <cmath>

#include "doppel/control/controllers/detail/parameter_value.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

constexpr const char* kReferenceTimeout = "reference_timeout";
constexpr geometry_msgs::msg::Twist kNoTwist{{kNaN, kNaN, kNaN}, {kNaN, kNaN, kNaN}};

}  // namespace

void refuse_base_parameter(const ControllerContext& context, const std::string& parameter,
                           const std::string& why, const std::string& fix) {
  throw InputError("control.base_parameter", place_of(context, parameter),
                   fmt::format("controller '{}': '{}' {}", context.name, parameter, why), fix);
}

std::vector<std::string> declare_driven_joints(ControllerContext& context, const std::string& parameter,
                                               const std::vector<std::string>& names) {
  if (check_joints(context, parameter, names) != names)
    refuse_base_parameter(context, parameter, "lists a joint that mimics another and has no drive",
                          "list driven joints only");
  return names;
}

void ReferenceBase::declare_base(ControllerContext& context, double timeout,
                                 const OdometryPublisher::Options& odometry) {
  context_ = &context;
  declare<double>(context.node->parameters(), context.overrides, kReferenceTimeout, timeout,
                  {"s, for which a reference is valid; 0: for one update", false, check_positive_or_zero});
  publisher_.declare(context, odometry);
  context.node->subscribe<geometry_msgs::msg::TwistStamped>(
      "~/reference",
      [this](const auto& message) {
        if (active_ && !chained_) command_.receive(message);
      },
      Qos::system_default_subscription());
}

Status ReferenceBase::configure_base(std::size_t window) {
  const Duration timeout =
      from_seconds(parameter_value<double>(context_->node->parameters(), kReferenceTimeout));
  uses_once_ = timeout == Duration{};
  command_.configure(*context_, kReferenceTimeout, timeout);
  odometry_.set_window(window);
  odometry_.reset();
  return publisher_.configure();
}

void ReferenceBase::clear_reference() {
  for (CommandHandle& reference : reference_handles) reference.set(kNaN);
}

Status ReferenceBase::on_activate() {
  active_ = true;
  chained_ = false;
  command_.forget(context_->node->bus().now());
  clear_reference();
  rest();
  return {};
}

Status ReferenceBase::on_deactivate() {
  active_ = false;
  stop_wheels();
  command_.forget(context_->node->bus().now());
  clear_reference();
  rest();
  return {};
}

void ReferenceBase::set_chained_mode(bool chained) {
  chained_ = chained;
  command_.forget(context_->node->bus().now());
  clear_reference();
}

void ReferenceBase::take_reference(Time now) {
  write_reference(command_.is_stale(now) ? kNoTwist : command_.twist());
  if (uses_once_) command_.forget(now);
}

void ReferenceBase::update(Time now, Duration period) {
  if (!chained_) take_reference(now);
  const double dt = to_seconds(period);
  const std::optional<PlanarVelocity> wanted = reference();
  measure(wanted, dt);
  if (wanted) {
    command(*wanted, dt);
  } else {
    stop_wheels();
    rest();  // the next reference begins from rest
  }
  publisher_.publish(now, odometry_);
  publish_state(now);
  if (chained_) clear_reference();  // a leader writes it before each update
}

void ReferenceBase::housekeeping(Time now) {
  if (!chained_) command_.report_braking(now);
}

}  // namespace doppel
