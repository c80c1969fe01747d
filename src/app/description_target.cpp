#include "app/description_target.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <utility>

#include "app/print_stderr.h"
#include "doppel/base/core/installation.h"
#include "doppel/description/overlay/overlay.h"

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

void print_diagnostics(const Diagnostics& diagnostics, bool notes, std::size_t most_of_rule) {
  for (const Diagnostic& diagnostic : condensed(diagnostics, most_of_rule)) {
    if (diagnostic.severity != Severity::note || notes) print_stderr("{}\n", diagnostic.str());
  }
}

}  // namespace doppel::app
