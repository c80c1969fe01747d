#pragma once
// The node of a rig's topics, which is replaced together with its sensors.

#include <functional>
#include <memory>
#include <string>

#include "doppel/base/core/log.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/topic_conflict.h"
#include "doppel/sensors/rigs/detail/sensor_names.h"

namespace doppel {

// Calls make(node, leaves_out) with a node beside the former one, so that topics that stay never vanish.
// Where that throws TopicConflict, because an edit has changed the type of a topic, the former node goes
// first, and what release_others() releases; then `leaves_out` is true.
template <class Make>
std::unique_ptr<Node> renewed_node(Bus& bus, std::unique_ptr<Node>& former, const Make& make,
                                   const std::function<void()>& release_others = {}) {
  constexpr const char* kName = "/doppel_sensors";
  auto node = std::make_unique<Node>(bus, kName);
  try {
    make(*node, false);
  } catch (const TopicConflict&) {
    former.reset();
    if (release_others) release_others();
    node.reset();
    node = std::make_unique<Node>(bus, kName);
    make(*node, true);
  }
  return node;
}

// make(in), or nullptr and an error in the log where it throws TopicConflict: then the sensor has none of its
// topics.
template <class Make>
auto made_or_left_out(const RigSensor& sensor, Node& in, bool leaves_out, const Log& log, const Make& make)
    -> decltype(make(in)) {
  if (!leaves_out) return make(in);
  try {
    Node trial(in.bus(), in.given_name());  // takes back the topics before the one that fails
    static_cast<void>(make(trial));
    return make(in);
  } catch (const TopicConflict& conflict) {
    const SourceLocation& where = sensor.description.source;
    const std::string element =
        conflict.asked() == "sensor_msgs/msg/CameraInfo" ? "<camera_info_topic>" : "<topic>";
    log.error("sensors", (where.known() ? where.str() + ": " : "") + "the sensor '" + sensor_key(sensor) +
                             "' publishes nothing: its topic " + conflict.topic() + " of type " +
                             conflict.asked() + " is in use with type " + conflict.used() + "; give it a " +
                             element + " of its own");
    return nullptr;
  }
}

}  // namespace doppel
