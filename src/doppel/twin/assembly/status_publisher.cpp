#include "doppel/twin/assembly/status_publisher.h"

#include <fmt/format.h>

#include "doppel/twin/assembly/runner.h"
#include "doppel/twin/loop/twin_robot.h"

namespace doppel {
namespace {

constexpr std::chrono::milliseconds kStatusPeriod{250};
constexpr std::chrono::milliseconds kDiagnosticsPeriod{1000};
constexpr double kSlow = 0.95;  // of the requested speed: below it the loop does not keep up

double seconds(double microseconds) {
  return microseconds * 1e-6;
}

}  // namespace

StatusPublisher::StatusPublisher(Bus& bus, std::string robot, WallTime now)
    : bus_(bus),
      node_(bus, "/doppel"),
      begin_(now),
      next_status_(now),
      next_diagnostics_(now + kDiagnosticsPeriod),
      robot_(std::move(robot)) {
  status_topic_ = node_.advertise<doppel_msgs::msg::TwinStatus>("~/status", {.depth = 1, .latched = true});
  diagnostics_topic_ = node_.advertise<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", {.depth = 1});
}

void StatusPublisher::publish_due(const Loop& loop, WallTime now) {
  const bool changed = loop.control.paused != status_.paused || loop.control.speed != status_.speed ||
                       loop.control.divergence != status_.divergence || loop.time < last_time_;
  last_time_ = loop.time;
  if (changed || now >= next_status_) {
    publish_status(loop, now);
    next_status_ = now + kStatusPeriod;
  }
  if (now >= next_diagnostics_) {
    if (diagnostics_topic_.has_listeners()) publish_diagnostics(loop);
    next_diagnostics_ = now + kDiagnosticsPeriod;
  }
}

void StatusPublisher::publish_status(const Loop& loop, WallTime now) {
  const LoopMeter::Averages averages = loop.control.paused ? LoopMeter::Averages{} : loop.meter.averages();
  const LatenessHistogram& lateness = loop.run.lateness;
  status_.sim_time = to_seconds(loop.time);
  status_.wall_time = std::chrono::duration<double>(now - begin_).count();
  status_.steps = loop.steps;
  status_.real_time_factor = averages.real_time_factor;
  status_.paused = loop.control.paused;
  status_.speed = loop.control.speed;
  status_.divergence = loop.control.divergence;
  status_.real_hardware.clear();
  for (const auto& robot : loop.robots) {
    if (robot->has_loop()) status_.real_hardware.push_back(robot->name_space());
  }
  status_.lateness_p50 = seconds(lateness.percentile(0.5));
  status_.lateness_p99 = seconds(lateness.percentile(0.99));
  status_.lateness_max = seconds(lateness.worst());
  status_.time_control = averages.control;
  status_.time_physics = averages.physics;
  status_.time_publish = averages.publish;
  status_.time_bus = averages.bus;
  status_.time_idle = averages.idle;
  status_.overruns = loop.run.overruns;
  status_.skipped = bus_.skipped();
  status_topic_.publish(status_, loop.time);
}

void StatusPublisher::publish_diagnostics(const Loop& loop) {
  using diagnostic_msgs::msg::DiagnosticStatus;
  const LoopMeter::Averages& averages = loop.meter.averages();
  const double wanted = loop.control.speed;
  const bool overran = loop.run.overruns > overruns_reported_;
  const bool slow = averages.known && wanted > 0 && averages.real_time_factor < kSlow * wanted;
  DiagnosticStatus status;
  status.name = "doppel: loop";
  status.hardware_id = robot_;
  const bool diverged = !loop.control.divergence.empty();
  status.level = diverged                                    ? DiagnosticStatus::ERROR
                 : !loop.control.paused && (overran || slow) ? DiagnosticStatus::WARN
                                                             : DiagnosticStatus::OK;
  if (diverged) {
    status.message = "paused: " + loop.control.divergence;
  } else if (loop.control.paused) {
    status.message = "paused";
  } else if (overran) {
    status.message = fmt::format("fell 100 ms behind the wall clock {} times in the last second",
                                 loop.run.overruns - overruns_reported_);
  } else if (slow) {
    status.message =
        fmt::format("runs at {:.2f} x real time instead of {:g}", averages.real_time_factor, wanted);
  } else {
    status.message =
        averages.known ? fmt::format("runs at {:.2f} x real time", averages.real_time_factor) : "runs";
  }
  overruns_reported_ = loop.run.overruns;
  const auto add = [&status](const char* key, std::string value) {
    status.values.push_back({key, std::move(value)});
  };
  add("simulated time (s)", fmt::format("{:.3f}", to_seconds(loop.time)));
  add("real-time factor", fmt::format("{:.3f}", averages.real_time_factor));
  add("requested speed", wanted > 0 ? fmt::format("{:g}", wanted) : "as fast as possible");
  add("control (us per step)", fmt::format("{:.2f}", averages.control));
  add("physics (us per step)", fmt::format("{:.2f}", averages.physics));
  add("publish (us per step)", fmt::format("{:.2f}", averages.publish));
  add("bus (us per step)", fmt::format("{:.2f}", averages.bus));
  add("idle (us per step)", fmt::format("{:.2f}", averages.idle));
  add("lateness p99 (us)", fmt::format("{:.1f}", loop.run.lateness.percentile(0.99)));
  add("overruns", fmt::format("{}", loop.run.overruns));
  add("messages skipped for slow clients", fmt::format("{}", bus_.skipped()));
  diagnostic_msgs::msg::DiagnosticArray message;
  message.header.stamp = to_time_msg(bus_.stamp(loop.time));
  message.status.push_back(std::move(status));
  diagnostics_topic_.publish(message, loop.time);
}

}  // namespace doppel
