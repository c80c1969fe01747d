#include "app/snapshot.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/process.h"

namespace doppel::app {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json rest_of(const std::optional<RestReport>& rest) {
  if (!rest) return nullptr;
  std::vector<std::string> complaints = rest->unsettled;
  if (!rest->base.empty()) complaints.push_back(rest->base);
  return {{"time_s", to_seconds(rest->time)},
          {"joints_at_rest", rest->unsettled.empty()},
          {"complaints", complaints},
          {"base_linear", number(rest->base_linear)},
          {"base_angular", number(rest->base_angular)}};
}

Json base_of(const Pose& X_WB) {
  const Eigen::Vector3d p = X_WB.translation();
  const Eigen::Quaterniond q(X_WB.linear());
  return {{"xyz", {number(p.x()), number(p.y()), number(p.z())}},
          {"quaternion_xyzw", {number(q.x()), number(q.y()), number(q.z()), number(q.w())}}};
}

void add_robot(const Summary::Robot& robot, Json& out) {
  out["rest"] = rest_of(robot.rest);
  if (!robot.rest_reason.empty()) out["rest_reason"] = robot.rest_reason;
  if (robot.X_WB) out["base"] = base_of(*robot.X_WB);
}

}  // namespace

Snapshot take_snapshot(Twin& twin) {
  Snapshot out;
  out.now = twin.now();
  for (const auto& robot : twin.robots()) {
    const std::string scope = twin.robots().size() > 1 ? robot->name() + "::" : "";
    for (JointSnapshot& joint : robot->joints()) {
      joint.name.insert(0, scope);
      out.joints.push_back(std::move(joint));
    }
    for (ControllerView& controller : robot->controller_manager().controllers()) {
      controller.name.insert(0, scope);
      out.controllers.push_back(std::move(controller));
    }
    out.stopped = out.stopped || robot->controller_manager().is_stopped();
  }
  return out;
}

std::string to_json(const Summary& summary) {
  Json out;
  out["version"] = 1;
  out["robot"] = summary.robot;
  out["engine"] = summary.engine;
  out["end"] = name_of(summary.run.end);
  out["startup_ms"] = number(summary.startup_ms);
  out["sim_time_s"] = to_seconds(summary.run.simulated);
  out["wall_time_s"] = static_cast<double>(summary.run.wall.count()) * 1e-9;
  out["steps"] = summary.run.steps;
  out["real_time_factor"] = number(summary.run.real_time_factor());
  out["overruns"] = summary.run.overruns;
  if (summary.run.lateness.count() > 0) {
    out["lateness_us"] = {{"p50", summary.run.lateness.percentile(0.5)},
                          {"p99", summary.run.lateness.percentile(0.99)},
                          {"p99.9", summary.run.lateness.percentile(0.999)},
                          {"max", summary.run.lateness.worst()}};
  }
  out["state_hash"] = fmt::format("{:016x}", summary.state_hash);
  out["peak_rss_mb"] = peak_rss_mb();
  // Null: the robot was commanded, or there is none.
  if (summary.robots.empty()) {
    out["rest"] = nullptr;
  } else {
    add_robot(summary.robots.front(), out);
  }
  if (summary.robots.size() > 1) {
    for (const Summary::Robot& robot : summary.robots) {
      add_robot(robot, out["robots"][robot.name]);
      out["robots"][robot.name]["state_hash"] = fmt::format("{:016x}", robot.state_hash);
    }
  }
  out["oscillations"] = Json::array();
  for (const OscillationReport& found : summary.oscillations)
    out["oscillations"].push_back({{"joint", found.joint}, {"message", found.message}});
  for (const Summary::Sensor& sensor : summary.sensors) {
    out["sensors"][sensor.name] = {{"samples", sensor.samples},
                                   {"left_out", sensor.left_out},
                                   {"sensor_hash", fmt::format("{:016x}", sensor.hash)}};
  }
  out["controllers"] = Json::object();
  for (const ControllerView& controller : summary.last.controllers) {
    out["controllers"][controller.name] = {{"type", controller.type}, {"state", to_string(controller.state)}};
  }
  out["joints"] = Json::object();
  for (const JointSnapshot& joint : summary.last.joints) {
    out["joints"][joint.name] = {{"q", number(joint.q)},
                                 {"v", number(joint.v)},
                                 {"tau", number(joint.tau)},
                                 {"target", number(joint.target)}};
  }
  return out.dump(2);
}

}  // namespace doppel::app
