#include "doppel/ros/bus/rosout.h"

#include <mutex>

#include "doppel/ros/bus/standard_node.h"

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

void fill_place(rcl_interfaces::msg::Log& line, const CodeLocation& where) {
  line.file = where.file;
  line.function = where.function;
  line.line = static_cast<std::uint32_t>(where.line);
}

// The shared state of the sinks: the log may outlive the bus.
struct Rosout::Endpoint {
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
    fill_place(line, said.where);
    topic.publish(line, bus.now());
  }

  Node node;
  Publisher<Line> topic;
};

Rosout::Rosout(Bus& bus) : impl_(std::make_shared<Impl>(bus)), endpoint_(std::make_shared<Endpoint>()) {
  endpoint_->bus = &bus;
}

Rosout::~Rosout() {
  const std::lock_guard lock(endpoint_->mutex);
  endpoint_->bus = nullptr;
}

Log::Sink Rosout::sink() const {
  return [endpoint = endpoint_, weak = std::weak_ptr(impl_)](const LogLine& line) {
    const std::lock_guard lock(endpoint->mutex);
    if (endpoint->bus == nullptr) return;
    endpoint->bus->post([weak, line] {
      if (const auto impl = weak.lock()) impl->publish(line);
    });
  };
}

}  // namespace doppel
