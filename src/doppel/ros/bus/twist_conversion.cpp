#include "doppel/ros/bus/twist_conversion.h"

#include <fmt/format.h>

#include "doppel/ros/messages/geometry_msgs.h"

namespace doppel {
namespace {

using geometry_msgs::msg::Twist;
using geometry_msgs::msg::TwistStamped;

}  // namespace

bool is_convertible_twist(std::string_view came, std::string_view read) {
  return (came == Twist::kType && read == TwistStamped::kType) ||
         (came == TwistStamped::kType && read == Twist::kType);
}

std::string twist_conversion_text(std::string_view who, std::string_view topic, std::string_view came,
                                  bool refused) {
  const bool plain = came == Twist::kType;
  const char* taken = plain ? "its messages get the time of their arrival as stamp, and are used"
                            : "its messages are used without their stamp";
  return fmt::format(
      "{} publishes {} on {}, where {} is read: {}. On a real robot ROS 2 drops them without any report; set "
      "stamped:={} there (teleop_twist_keyboard -p stamped:={}, teleop_twist_joy -p "
      "publish_stamped_twist:={}, Nav2 "
      "enable_stamped_cmd_vel: {})",
      who, came, topic, plain ? TwistStamped::kType : Twist::kType,
      refused ? "its messages are refused, because of --strict" : taken, plain, plain, plain, plain);
}

Status convert_twist(std::string_view came, std::span<const std::byte> cdr,
                     const builtin_interfaces::msg::Time& stamp, Bytes& converted) {
  TwistStamped stamped;
  const bool plain = came == Twist::kType;
  if (Status read = plain ? from_cdr(cdr, stamped.twist) : from_cdr(cdr, stamped); !read) return read;
  stamped.header.stamp = stamp;
  converted = plain ? to_cdr(stamped) : to_cdr(stamped.twist);
  return {};
}

}  // namespace doppel
