#include "app/verbs/description_target.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <utility>

#include "app/print_stderr.h"
#include "app/process.h"
#include "doppel/base/core/installation.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/scenario/resolve/controllers_search.h"
#include "doppel/scenario/resolve/ros1_controllers.h"

namespace doppel::app {

void add_target(CLI::App& verb, std::vector<std::string>& words, bool required) {
  verb.add_option("TARGET", words,
                  "Name of a bundled robot, a .urdf or .xacro file, or a folder with a ROS package or "
                  "workspace, and name:=value arguments for xacro")
      ->required(required);
}

std::pair<std::string, std::string> split_argument(const std::string& text) {
  const std::size_t at = text.find(":=");
  if (at == std::string::npos || at == 0) {
    throw InputError("cli.argument", {}, fmt::format("'{}' is not of the form name:=value", text),
                     "write for example use_sim:=true");
  }
  return {text.substr(0, at), text.substr(at + 2)};
}

DescriptionTarget open_target(const std::string& target, XacroArguments arguments) {
  return doppel::open_target(target, std::move(arguments), data_folder() / "robots");
}

DescriptionTarget open_target(const std::vector<std::string>& words) {
  XacroArguments arguments;
  for (std::size_t i = 1; i < words.size(); ++i) arguments.push_back(split_argument(words[i]));
  return open_target(words.front(), std::move(arguments));
}

LoadedDescription load_target(DescriptionTarget& target) {
  Diagnostics diagnostics;
  LoadedDescription loaded =
      load_corrected(target.target.description, target.arguments, target.resolver, diagnostics);
  print_diagnostics(diagnostics);
  return loaded;
}

FoundControllers find_controllers(const RobotDescription& robot, const DescriptionTarget& target,
                                  const std::string& given) {
  std::vector<ControllersFile> files;
  if (!given.empty()) {
    Diagnostics diagnostics;
    files.push_back(controllers_in(load_controllers(given, robot, diagnostics)));
    print_diagnostics(diagnostics);
  } else {
    ControllersSearch search = find_controllers_files(robot, target.target, target.resolver);
    Diagnostics diagnostics;
    report(search, diagnostics);
    print_diagnostics(diagnostics);
    files = std::move(search.files);
  }
  FoundControllers found;
  for (const ControllersFile& file : files) {
    found.files.push_back(file.path);
    for (JointGroup& controller : joint_groups(file)) found.controllers.push_back(std::move(controller));
  }
  return found;
}

void print_diagnostics(const Diagnostics& diagnostics, bool notes, std::size_t most_of_rule) {
  for (const Diagnostic& diagnostic : condensed(diagnostics, most_of_rule)) {
    if (diagnostic.severity != Severity::note || notes) print_stderr("{}\n", diagnostic.str());
  }
}

}  // namespace doppel::app
