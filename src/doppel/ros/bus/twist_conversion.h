#pragma once
// geometry_msgs Twist and TwistStamped: ROS 2's tools for driving publish the one or the other, depending on a
// parameter, and its middleware drops all messages of a publisher whose type is not the reader's, without a
// report. The bus converts them instead (BusOptions::converts_twists) and says so once.

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "doppel/base/core/status.h"
#include "doppel/export.h"
#include "doppel/ros/messages/builtin_interfaces.h"
#include "doppel/ros/messages/codec.h"

namespace doppel {

// True if messages of type `came` can be converted for readers of type `read`.
DOPPEL_API bool is_convertible_twist(std::string_view came, std::string_view read);

// The text for users: "/teleop publishes geometry_msgs/msg/Twist on /base/cmd_vel, where ...". `who`: the
// publisher; `refused`: its messages are not converted.
DOPPEL_API std::string twist_conversion_text(std::string_view who, std::string_view topic,
                                             std::string_view came, bool refused);

// The CDR form of a message of type `came` as one of the other type, stamped if that has a stamp. Refuses
// malformed bytes. Precondition: is_convertible_twist(came, ...).
DOPPEL_API Status convert_twist(std::string_view came, std::span<const std::byte> cdr,
                                const builtin_interfaces::msg::Time& stamp, Bytes& converted);

}  // namespace doppel
