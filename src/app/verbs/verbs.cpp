#include "app/verbs/verbs.h"

#include <CLI/CLI.hpp>

namespace doppel::app {

void add_verbs(CLI::App& app, int& exit_code) {
  for (const auto add : {add_topic,     add_control, add_move,   add_stop,    add_spawn,          add_tf,
                         add_node,      add_service, add_param,  add_action,  add_interface,      add_xacro,
                         add_tree,      add_info,    add_mass,   add_convert, add_overlay,        add_diff,
                         add_calibrate, add_check,   add_verify, add_engines, add_compare_engines}) {
    add(app, exit_code);
  }
}

}  // namespace doppel::app
