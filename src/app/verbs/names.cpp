// doppel names: the names of a running twin, one a line, for the completion of shells. Hidden from --help.

#include <algorithm>

#include "app/verbs/controllers.h"
#include "app/verbs/robot_watch.h"
#include "app/verbs/tf_frames.h"
#include "app/verbs/verbs.h"

namespace doppel::app {
namespace {

struct NamesOptions {
  std::string kind;
};

std::vector<std::string> joint_names(Client& twin) {
  const RobotWatch robot(twin, find_manager(twin, ""));
  if (const Model* model = robot.model()) return model->driven_joint_names();
  std::vector<std::string> names;
  for (const auto& [name, sample] : robot.joints()) names.push_back(name);
  return names;
}

std::vector<std::string> frame_names(Client& twin) {
  TfFrames frames(twin);
  static_cast<void>(frames.gather_all());
  return frames.names();
}

std::vector<std::string> controller_names(Client& twin) {
  std::vector<std::string> names;
  for (const auto& controller : list_controllers(twin, find_manager(twin, "")))
    names.push_back(controller.name);
  return names;
}

int print_names(Shell& shell, const NamesOptions& options) {
  Client& twin = shell.twin();
  const bool is_target = options.kind == "targets";
  const std::vector<std::string> names = is_target                  ? joint_names(twin)
                                         : options.kind == "frames" ? frame_names(twin)
                                                                    : controller_names(twin);
  for (const std::string& name : names) print_line("{}{}\n", name, is_target ? "=" : "");
  return 0;
}

}  // namespace

void add_names(CLI::App& app, int& exit_code) {
  add_verb<NamesOptions>(
      app, "names", "Names of a twin for the completion of shells", "doppel names frames", exit_code,
      [](CLI::App& verb, NamesOptions& options) {
        verb.add_option("kind", options.kind, "targets (of move), frames or controllers")
            ->required()
            ->check(CLI::IsMember({"targets", "frames", "controllers"}));
      },
      print_names)
      ->group("");
}

}  // namespace doppel::app
