#include "app/verbs/verbs.h"

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <vector>

#include "app/command_tree.h"
#include "app/completion.h"
#include "app/man_page.h"
#include "app/usage.h"
#include "doppel/export.h"
#include "doppel/session/validation/live_validation.h"

namespace doppel::app {
namespace {

// The verbs below a heading of --help, in its order.
struct Heading {
  const char* name;
  std::vector<std::function<void(CLI::App&, int& exit_code)>> verbs;
};

std::vector<Heading> headings(const RosArguments& ros) {
  const auto add_bag_with = [&ros](CLI::App& app, int& exit_code) { add_bag(app, ros, exit_code); };
  const auto add_teleop_with = [&ros](CLI::App& app, int& exit_code) { add_teleop(app, ros, exit_code); };
  return {{"Twins",
           {add_move, add_teleop_with, add_stop, add_spawn, add_saved_states, add_robots, add_worlds,
            add_sensor, add_snapshot}},
          {"ROS 2's verbs",
           {add_topic, add_control, add_tf, add_node, add_service, add_param, add_action, add_interface}},
          {"Real arms", {add_hardware, add_mirror, add_identify}},
          {"Descriptions",
           {add_new, add_check, add_validate, add_tune, add_xacro, add_tree, add_info, add_mass, add_ik,
            add_reach, add_convert, add_overlay, add_diff, add_calibrate, add_world}},
          {"Recordings", {add_bag_with}},
          {"Physics", {add_verify, add_base, add_engines, add_compare_engines}},
          {"This machine", {add_doctor, add_completion, add_man, add_help, add_names}}};
}

}  // namespace
}  // namespace doppel::app

// For a twin that is asked to validate its robot, called by up.
extern "C" DOPPEL_API void doppel_make_validation(const doppel::LiveValidationOptions& options,
                                                  std::shared_ptr<doppel::ValidationWork>& out) {
  out = doppel::make_live_validation(options);
}

// The entry of the module, called by main() behind add_up() and add_view().
extern "C" DOPPEL_API void doppel_add_verbs(CLI::App& app, const doppel::RosArguments& ros, int& exit_code) {
  std::size_t grouped = 0;
  for (const doppel::app::Heading& heading : doppel::app::headings(ros)) {
    for (const auto& add : heading.verbs) add(app, exit_code);
    const auto verbs = doppel::app::verbs_of(app);  // hidden ones have no heading
    for (; grouped < verbs.size(); ++grouped)
      app.get_subcommand(verbs[grouped]->get_name())->group(heading.name);
  }
}
