#pragma once
// The type of a message from its "ros2msg" text, as bags and Foxglove's protocol carry it: the fields of the
// type, then "===" lines with "MSG: package/Name" and the fields of each type that it uses. Source:
// mcap.dev/spec/registry, ros2msg; docs.ros.org, "About ROS 2 interfaces".

#include <memory>
#include <string>
#include <string_view>

#include "doppel/export.h"
#include "doppel/ros/messages/codec.h"

namespace doppel {

// `name`: "sensor_msgs/msg/JointState". Constants and default values are not part of the type. Returns
// nullptr with the reason in `status` ("line 4: ...") for a text that cannot be read, and what
// described_type() refuses. Any thread.
[[nodiscard]] DOPPEL_API std::shared_ptr<const TypeSupport> type_of_schema(std::string_view name,
                                                                           std::string_view text,
                                                                           Status& status);

}  // namespace doppel
