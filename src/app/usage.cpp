#include "app/usage.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <memory>

#include "app/command_tree.h"
#include "app/failures.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/synonyms.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"

namespace doppel::app {
namespace {

constexpr std::array kFirstDay{"up", "view", "new", "check", "move", "stop"};

std::string path_of(const CLI::App& command) {
  return command.get_parent() == nullptr ? command.get_name()
                                         : path_of(*command.get_parent()) + " " + command.get_name();
}

// The path without the program's name: "tf" of "doppel tf".
std::string group_of(const CLI::App& command) {
  return command.get_parent() == nullptr ? ""
                                         : path_of(command).substr(path_of(*command.get_parent()).size() + 1);
}

std::vector<std::string> verb_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* verb : verbs_of(command)) names.push_back(verb->get_name());
  return names;
}

// The answer to a word that is no verb of `command`.
std::string unknown_verb(const CLI::App& command, const std::string& word) {
  const std::string start = fmt::format("error: '{}' is not a verb of {}", word, path_of(command));
  const std::string pointer = pointer_for(group_of(command), word);
  if (!pointer.empty()) return fmt::format("{}\n  fix: {}\n", start, pointer);
  return fmt::format("{}{}\n  fix: {} --help lists its verbs\n", start,
                     did_you_mean(word, verb_names(command)), path_of(command));
}

std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options_of(command)) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

// The answer to an option that `command` does not have.
std::string unknown_option(const CLI::App& command, const std::string& typed) {
  const std::string name = typed.substr(0, typed.find('='));
  // A short option is no misspelled long one.
  const std::optional<std::string> nearest =
      name.starts_with("--") ? nearest_name(name, option_names(command)) : std::nullopt;
  return fmt::format("error: {} has no option '{}'{}\n  fix: {} --help lists its options\n", path_of(command),
                     name, nearest ? fmt::format("; did you mean '{}'?", *nearest) : "", path_of(command));
}

int print_help(const CLI::App& app, const std::vector<std::string>& path, bool all) {
  const CLI::App* command = &app;
  for (const std::string& word : path) {
    const auto verbs = verbs_of(*command);
    const auto next = std::ranges::find(verbs, word, &CLI::App::get_name);
    if (next == verbs.end()) {
      print_stderr("{}", unknown_verb(*command, word));
      return kBadInput;
    }
    command = *next;
  }
  // App::help() would print that of the verb "help", which is being run.
  deliver(path.empty() && !all
              ? short_help(app)
              : command->get_formatter()->make_help(command, path_of(*command), CLI::AppFormatMode::Normal));
  return 0;
}

}  // namespace

std::string short_help(const CLI::App& app) {
  std::string out = app.get_description() + "\n\n";
  for (const char* name : kFirstDay)
    out += fmt::format("  doppel {:<8} {}\n", name, app.get_subcommand(name)->get_description());
  return out +
         fmt::format(
             "\nStart with   doppel up omarm_one\n\n  doppel help VERB    options and examples of a verb\n  "
             "doppel help --all   all {} verbs: topic, control, tf, overlay, convert, ...\n",
             verbs_of(app).size());
}

void add_help(CLI::App& app, int& exit_code) {
  struct HelpOptions {
    std::vector<std::string> path;
    bool all = false;
  };
  const auto options = std::make_shared<HelpOptions>();
  CLI::App* verb = app.add_subcommand("help", "Print the help of doppel, or of a verb");
  verb->add_option("VERB", options->path, "Of this verb: up, topic echo, ...");
  verb->add_flag("--all", options->all, "List all verbs");
  verb->footer("Examples:\n  doppel help --all\n  doppel help up\n  doppel help topic echo");
  verb->callback([&app, options, &exit_code] { exit_code = print_help(app, options->path, options->all); });
}

int report_usage(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);
  const CLI::App* command = &app;
  while (command->remaining().empty() && !command->get_subcommands().empty())
    command = command->get_subcommands().back();
  for (const std::string& word : command->remaining()) {
    if (word == "--") continue;
    if (word.starts_with('-') && word.size() > 1) {
      print_stderr("{}", unknown_option(*command, word));
      return kBadInput;
    }
    if (verbs_of(*command).empty()) break;
    print_stderr("{}", unknown_verb(*command, word));
    return kBadInput;
  }
  print_stderr("error: {}\n  fix: {} --help shows its usage\n", error.what(), path_of(*command));
  return kBadInput;
}

}  // namespace doppel::app
