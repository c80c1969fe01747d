#include "app/verbs/verbs.h"

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

namespace doppel::app {

void add_verbs(CLI::App& app, const RosArguments& ros, int& exit_code) {
  add_move(app, exit_code);
  add_teleop(app, ros, exit_code);
  for (const auto add :
       {add_stop,   add_spawn,     add_robots, add_topic,    add_control,   add_tf,
        add_node,   add_service,   add_param,  add_action,   add_interface, add_new,
        add_xacro,  add_tree,      add_info,   add_mass,     add_convert,   add_overlay,
        add_diff,   add_calibrate, add_check,  add_verify,   add_engines,   add_compare_engines,
        add_doctor, add_world,     add_base,   add_snapshot, add_sensor,    add_worlds}) {
    add(app, exit_code);
  }
  add_names(app, exit_code);
}

void group_verbs(CLI::App& app) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> groups{
      {"Twins",
       {"up", "view", "move", "teleop", "stop", "spawn", "delete", "robots", "worlds", "sensor", "snapshot"}},
      {"ROS 2's verbs", {"topic", "control", "tf", "node", "service", "param", "action", "interface"}},
      {"Descriptions",
       {"new", "check", "xacro", "tree", "info", "mass", "convert", "overlay", "diff", "calibrate", "world"}},
      {"Physics", {"verify", "base", "engines", "compare-engines"}},
      {"This machine", {"doctor", "completion", "man", "help"}}};
  for (const auto& [group, verbs] : groups) {
    for (const std::string& verb : verbs) app.get_subcommand(verb)->group(group);
  }
}

}  // namespace doppel::app
