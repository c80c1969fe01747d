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

std::string_view to_string(RunEnd end) {
  switch (end) {
    case RunEnd::duration_reached:
      return "duration_reached";
    case RunEnd::stopped:
      return "stopped";
    case RunEnd::diverged:
      return "diverged";
  }
  return "stopped";
}

}  // namespace

Snapshot take_snapshot(Twin& twin) {
  const ControllerManager& manager = twin.controller_manager();
  return {twin.now(), twin.joints(), manager.controllers(), manager.is_stopped()};
}

std::string to_json(const Summary& summary) {
  Json out;
  out["version"] = 1;
  out["robot"] = summary.robot;
  out["engine"] = summary.engine;
  out["end"] = to_string(summary.run.end);
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
  // Null: it ended before, no controllers were to start, or somebody commanded the robot.
  out["rest"] = nullptr;
  if (summary.rest) {
    out["rest"] = {{"time_s", to_seconds(summary.rest->at)},
                   {"joints_at_rest", summary.rest->complaints.empty()},
                   {"complaints", summary.rest->complaints},
                   {"base_linear", number(summary.rest->base_linear)},
                   {"base_angular", number(summary.rest->base_angular)}};
  }
  out["oscillations"] = Json::array();
  for (const OscillationReport& found : summary.oscillations)
    out["oscillations"].push_back({{"joint", found.joint}, {"message", found.message}});
  out["controllers"] = Json::object();
  for (const ControllerView& controller : summary.last.controllers) {
    out["controllers"][controller.name] = {{"type", controller.type},
                                           {"state", doppel::to_string(controller.state)}};
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
