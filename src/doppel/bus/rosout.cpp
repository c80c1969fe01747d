#include "doppel/bus/rosout.h"

#include <mutex>

#include "doppel/bus/standard_node.h"
#include "doppel/messages/rcl_interfaces.h"

namespace doppel {
namespace {

using Line = rcl_interfaces::msg::Log;

std::uint8_t level_of(Severity severity) {
  switch (severity) {
    case Severity::note:
      return Line::INFO;
    case Severity::warning:
      return Line::WARN;
    case Severity::error:
      return Line::ERROR;
  }
  return Line::INFO;
}

}  // namespace

// What the sinks hold: the log may outlive the bus.
struct Rosout::Door {
  std::mutex mutex;
  Bus* bus = nullptr;
};

struct Rosout::Impl {
  explicit Impl(Bus& bus) : node(bus, "/doppel") {
    make_standard(node);
    topic = node.advertise<Line>("/rosout", Qos::rosout());
  }

  void publish(const LogLine& said) {
    Bus& bus = node.bus();
    Line line;
    line.stamp = to_time_msg(bus.ros_now());
    line.level = level_of(said.severity);
    line.name = said.origin.empty() ? logger_name(node.name()) : said.origin;
    for (const std::string& name : bus.nodes()) {
      if (node_base_name(name) == said.origin) line.name = logger_name(name);
    }
    const auto least = bus.logger_levels().find(line.name);
    if (least != bus.logger_levels().end() && line.level < least->second) return;
    line.msg = said.text;
    topic.publish(line, bus.now());
  }

  Node node;
  Publisher<Line> topic;
};

Rosout::Rosout(Bus& bus) : impl_(std::make_shared<Impl>(bus)), door_(std::make_shared<Door>()) {
  door_->bus = &bus;
}

Rosout::~Rosout() {
  const std::lock_guard lock(door_->mutex);
  door_->bus = nullptr;
}

Log::Sink Rosout::sink() const {
  return [door = door_, weak = std::weak_ptr(impl_)](const LogLine& line) {
    const std::lock_guard lock(door->mutex);
    if (door->bus == nullptr) return;
    door->bus->post([weak, line] {
      if (const auto impl = weak.lock()) impl->publish(line);
    });
  };
}

}  // namespace doppel
