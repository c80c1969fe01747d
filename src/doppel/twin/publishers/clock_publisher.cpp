#include "doppel/twin/publishers/detail/clock_publisher.h"

namespace doppel {
namespace {

constexpr Duration kClockPeriod{10'000'000};

}  // namespace

ClockPublisher::ClockPublisher(Bus& bus, const Scene& scene) : scene_(scene) {
  pace_.restart(bus.now());
  if (!bus.sim_time()) return;
  node_.emplace(bus, "/gazebo");
  clock_ = node_->advertise<rosgraph_msgs::msg::Clock>("/clock");
}

Time ClockPublisher::publish(Time now) {
  publish_clock(now);
  return pace_.next(now, whole_steps(kClockPeriod, scene_.engine().world().settings().step));
}

void ClockPublisher::publish_clock(Time now) {
  if (!clock_.has_listeners()) return;
  rosgraph_msgs::msg::Clock message;
  message.clock = to_time_msg(now);
  clock_.publish(message, now);
}

}  // namespace doppel
