#pragma once
// The verbs of the plugin module doppel_verbs: all but up and view.

namespace CLI {
class App;
}
namespace doppel {
struct RosArguments;
}

namespace doppel::app {

// Each adds a verb; when it has run, `exit_code` is 0 for success, 1 for failure. Wrong use throws
// InputError.
// ros: --ros-args, for verbs that start nodes.
// ROS 2's verbs against a running twin, and move, teleop, stop, spawn.
void add_topic(CLI::App& app, int& exit_code);
void add_interface(CLI::App& app, int& exit_code);
void add_control(CLI::App& app, int& exit_code);
void add_tf(CLI::App& app, int& exit_code);
void add_node(CLI::App& app, int& exit_code);
void add_service(CLI::App& app, int& exit_code);
void add_param(CLI::App& app, int& exit_code);
void add_action(CLI::App& app, int& exit_code);
void add_move(CLI::App& app, int& exit_code);
void add_teleop(CLI::App& app, const RosArguments& ros, int& exit_code);
void add_stop(CLI::App& app, int& exit_code);
void add_spawn(CLI::App& app, int& exit_code);         // and delete
void add_saved_states(CLI::App& app, int& exit_code);  // save, restore and rewind

void add_hardware(CLI::App& app, int& exit_code);  // servos on this machine's ports
void add_mirror(CLI::App& app, int& exit_code);    // a running arm beside its twin
void add_identify(CLI::App& app, int& exit_code);  // its servos, from recordings

// Without a twin, over descriptions in files.
void add_xacro(CLI::App& app, int& exit_code);
void add_check(CLI::App& app, int& exit_code);
void add_validate(CLI::App& app, int& exit_code);
void add_tune(CLI::App& app, int& exit_code);
void add_overlay(CLI::App& app, int& exit_code);
void add_diff(CLI::App& app, int& exit_code);
void add_calibrate(CLI::App& app, int& exit_code);
void add_tree(CLI::App& app, int& exit_code);
void add_info(CLI::App& app, int& exit_code);
void add_mass(CLI::App& app, int& exit_code);
void add_convert(CLI::App& app, int& exit_code);
void add_ik(CLI::App& app, int& exit_code);
void add_reach(CLI::App& app, int& exit_code);
void add_bag(CLI::App& app, const RosArguments& ros, int& exit_code);
void add_verify(CLI::App& app, int& exit_code);
void add_engines(CLI::App& app, int& exit_code);
void add_compare_engines(CLI::App& app, int& exit_code);
void add_new(CLI::App& app, int& exit_code);
void add_robots(CLI::App& app, int& exit_code);
void add_doctor(CLI::App& app, int& exit_code);
void add_world(CLI::App& app, int& exit_code);
void add_worlds(CLI::App& app, int& exit_code);
void add_base(CLI::App& app, int& exit_code);      // drives a twin of its own
void add_snapshot(CLI::App& app, int& exit_code);  // of a twin of its own
void add_sensor(CLI::App& app, int& exit_code);
void add_names(CLI::App& app, int& exit_code);  // for completion

}  // namespace doppel::app
