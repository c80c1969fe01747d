#include "app/command_tree.h"

#include <fmt/format.h>

#include <map>

namespace doppel::app {
namespace {

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names = option.get_lnames();
  names.insert(names.end(), option.get_snames().begin(), option.get_snames().end());
  if (names.empty()) names.push_back(option.get_name(true));
  return names;
}

void add_shared_names(const CLI::App& command, const std::string& path, std::vector<std::string>& out) {
  std::map<std::string, int> owners;
  for (const CLI::Option* option : command.get_options({}))
    for (const std::string& name : names_of(*option)) ++owners[name];
  if (command.get_parent() != nullptr)
    for (const CLI::Option* above : positionals_of(*command.get_parent()))
      for (const std::string& name : names_of(*above))
        if (owners.contains(name)) ++owners[name];
  for (const auto& [name, count] : owners)
    if (count > 1) out.push_back(fmt::format("{}: {}", path, name));
  for (const CLI::App* verb : command.get_subcommands({}))
    add_shared_names(*verb, path.empty() ? verb->get_name() : path + " " + verb->get_name(), out);
}

}  // namespace

std::vector<const CLI::App*> verbs_of(const CLI::App& command) {
  return command.get_subcommands([](const CLI::App* verb) { return !verb->get_group().empty(); });
}

std::vector<const CLI::Option*> options_of(const CLI::App& command) {
  return command.get_options(
      [](const CLI::Option* option) { return option->nonpositional() && !option->get_group().empty(); });
}

std::vector<const CLI::Option*> positionals_of(const CLI::App& command) {
  return command.get_options(
      [](const CLI::Option* option) { return option->get_positional() && !option->nonpositional(); });
}

bool takes_value(const CLI::Option& option) {
  return option.get_items_expected_max() > 0 && option.get_type_size_max() > 0;
}

std::vector<std::string> shared_names(const CLI::App& command) {
  std::vector<std::string> out;
  add_shared_names(command, "", out);
  return out;
}

}  // namespace doppel::app
