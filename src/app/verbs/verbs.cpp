#include "app/verbs/verbs.h"

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "app/completion.h"
#include "app/man_page.h"
#include "app/usage.h"
#include "doppel/export.h"

namespace doppel::app {

namespace {

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
  add_completion(app, exit_code);
  add_man(app, exit_code);
  add_help(app, exit_code);
}

// Assigns every verb to its heading in --help.
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

}  // namespace
}  // namespace doppel::app

// The entry of the module, called by main() behind add_up() and add_view().
extern "C" DOPPEL_API void doppel_add_verbs(CLI::App& app, const doppel::RosArguments& ros, int& exit_code) {
  doppel::app::add_verbs(app, ros, exit_code);
  doppel::app::group_verbs(app);
}
