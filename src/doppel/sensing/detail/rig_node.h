#pragma once
// The node of a rig's topics, made anew with its sensors.

#include <memory>
#include <stdexcept>
#include <string>

#include "doppel/bus/bus.h"
#include "doppel/core/log.h"
#include "doppel/sensing/detail/sensor_names.h"

namespace doppel {

// Calls make(node, leaves_out) with a node beside the former one, so that topics that stay never vanish. Where that throws
// std::logic_error, because an edit has changed the type of a topic, the former node goes first; then `leaves_out` is true.
template <class Make>
std::unique_ptr<Node> renewed_node(Bus& bus, std::unique_ptr<Node>& former, const Make& make) {
  constexpr const char* kName = "/doppel_sensors";
  auto node = std::make_unique<Node>(bus, kName);
  try {
    make(*node, false);
  } catch (const std::logic_error&) {
    former.reset();
    node.reset();
    node = std::make_unique<Node>(bus, kName);
    make(*node, true);
  }
  return node;
}

// make(), or nullptr and an error in the log where it throws std::logic_error: its topic has another type elsewhere.
template <class Make>
auto made_or_left_out(const RigSensor& sensor, bool leaves_out, const Log& log, const Make& make)
    -> decltype(make()) {
  try {
    return make();
  } catch (const std::logic_error& conflict) {
    if (!leaves_out) throw;
    const Diagnostic error{Severity::error, "sensors.topic",
                           "the sensor '" + sensor_key(sensor) + "' publishes nothing: " + conflict.what(),
                           sensor.description.source, "give it a <topic> of its own"};
    log.line(error.severity, "sensors", error.str());
    return nullptr;
  }
}

}  // namespace doppel
