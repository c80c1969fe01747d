#include "app/completion.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <sstream>

#include "app/command_tree.h"
#include "app/documents.h"
#include "app/output.h"
#include "app/verbs/robots.h"
#include "doppel/base/core/installation.h"
#include "doppel/physics/contract/engine_modules.h"

namespace doppel::app {
namespace {

// The scripts get candidates by `doppel complete -- WORDS`, of which the last one is incomplete. A line is a
// word and, behind a tab, its description; ":files" represents files, and ":VERB ..." the lines that
// this command prints.
constexpr const char* kBashScript = R"sh(# doppel's completion for bash: source <(doppel completion bash)
_doppel() {
  local current=${COMP_WORDS[COMP_CWORD]} line found arguments
  current=${current//\\/}  # a name with spaces, as it was completed before
  COMPREPLY=()
  while IFS= read -r line; do
    case $line in
      :files) mapfile -t found < <(compgen -f -- "$current") ;;
      :*)
        IFS=' ' read -ra arguments <<< "${line#:}"
        mapfile -t found < <("${COMP_WORDS[0]}" "${arguments[@]}" 2> /dev/null)
        mapfile -t found < <(for line in "${found[@]}"; do [[ $line != "$current"* ]] || printf '%s\n' "$line"; done) ;;
      *) found=("${line%%$'\t'*}") ;;
    esac
    COMPREPLY+=("${found[@]}")
  done < <("${COMP_WORDS[0]}" complete -- "${COMP_WORDS[@]:1:COMP_CWORD}" 2> /dev/null)
  [[ ${COMPREPLY[0]-} != *= ]] || compopt -o nospace 2> /dev/null  # of move: the position follows
}
complete -o filenames -F _doppel doppel ./doppel
)sh";

constexpr const char* kZshScript = R"sh(#compdef doppel
# doppel's completion for zsh: source <(doppel completion zsh), or this file as _doppel in a folder of fpath
_doppel() {
  local line tab=$'\t'
  local -a described
  for line in "${(@f)$(${words[1]} complete -- "${(@)words[2,CURRENT]}" 2> /dev/null)}"; do
    case $line in
      :files) _files ;;
      ':names targets'*) compadd -S '' -- "${(@f)$(${words[1]} ${=line#:} 2> /dev/null)}" ;;
      :*) compadd -- "${(@f)$(${words[1]} ${=line#:} 2> /dev/null)}" ;;
      *) described+=("${${line%%$tab*}//:/\\:}:${line#*$tab}") ;;
    esac
  done
  (( ${#described} )) && _describe doppel described
}
if [[ ${funcstack[1]} == _doppel ]]; then
  _doppel "$@"
else
  compdef _doppel doppel
fi
)sh";

constexpr const char* kFishScript = R"sh(# doppel's completion for fish: doppel completion fish | source
function __doppel_candidates
  set -l before (commandline -opc)
  set -l current (commandline -ct)
  for line in ($before[1] complete -- $before[2..-1] "$current" 2> /dev/null)
    switch $line
      case ':files'
        __fish_complete_path "$current"
      case ':*'
        $before[1] (string split ' ' -- (string sub -s 2 -- $line)) 2> /dev/null
      case '*'
        echo $line
    end
  end
end
complete -c doppel -f -a '(__doppel_candidates)'
)sh";

// The words up to the incomplete one.
struct Typed {
  const CLI::App* command = nullptr;     // the deepest verb
  const CLI::Option* waiting = nullptr;  // the option whose value comes next
  std::size_t positionals = 0;           // words of `command` that are neither verbs nor options
  std::vector<std::string> described{};  // these words
  bool remote = false;
};

Typed follow(const CLI::App& app, const std::vector<std::string>& words) {
  Typed typed;
  typed.command = &app;
  for (const std::string& word : words) {
    if (typed.waiting != nullptr) {
      typed.waiting = nullptr;
    } else if (word.starts_with('-')) {
      typed.remote = typed.remote || word == "--remote";
      const CLI::Option* option = typed.command->get_option_no_throw(word);
      if (option != nullptr && takes_value(*option)) typed.waiting = option;
    } else {
      const auto verbs = verbs_of(*typed.command);
      const auto verb = std::ranges::find(verbs, word, &CLI::App::get_name);
      if (verb != verbs.end() && typed.positionals == 0) {
        typed.command = *verb;
      } else {
        ++typed.positionals;
        typed.described.push_back(word);
      }
    }
  }
  return typed;
}

std::string list_directive(const std::string& list, bool remote) {
  return ":" + list + (remote ? " --remote\n" : "\n");
}

struct Candidates {
  std::string current;  // the incomplete word
  std::string text;

  void add(const std::string& word, const std::string& about) {
    if (word.starts_with(current)) text += fmt::format("{}\t{}\n", word, about.substr(0, about.find('\n')));
  }
};

// The values that a check of CLI11 lists in the type's name: "TEXT:{bash,fish,zsh}".
std::vector<std::string> listed_values(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{'), end = type.find('}');
  std::vector<std::string> values;
  if (begin == std::string::npos || end == std::string::npos) return values;
  std::istringstream list(type.substr(begin + 1, end - begin - 1));
  for (std::string value; std::getline(list, value, ',');) values.push_back(value);
  return values;
}

void add_bundled(const char* folder, const char* about, Candidates& out) {
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(data_folder() / folder, none)) {
    const std::string ending = entry.path().extension().string();
    if (ending == ".yaml" || ending == ".sdf") out.add(entry.path().filename().string(), about);
  }
}

// The lines of `doppel names KIND`, from the running twin or the network.
std::string names_directive(const char* kind, bool remote) {
  return list_directive(fmt::format("names {}", kind), remote);
}

// The kind of values follows from the option's name.
void add_option_values(const CLI::Option& option, const Typed& typed, Candidates& out) {
  const std::string name = option.get_name();
  const std::vector<std::string> listed = listed_values(option);
  for (const std::string& value : listed) out.add(value, option.get_description());
  if (!listed.empty()) return;
  if (name.find("--engine") != std::string::npos) {
    for (const KnownEngine& engine : known_engines())
      out.add(engine.name, engine.available ? "a physics engine" : "a physics engine that is not installed");
  } else if (name == "--controller") {
    out.text += names_directive("controllers", typed.remote);
  } else {
    if (name == "--world") add_bundled("worlds", "a bundled world", out);
    if (name == "--datasheet") add_bundled("datasheets", "a bundled datasheet", out);
    out.text += ":files\n";
  }
}

// The kind of values follows from the positional's name.
void add_positional_values(const CLI::App& app, const CLI::Option& option, const Typed& typed,
                           Candidates& out) {
  const std::string name = option.get_name(true);
  for (const std::string& value : listed_values(option)) out.add(value, option.get_description());
  for (const char* kind : {"topic", "service", "node", "action"}) {
    if (name == kind) out.text += list_directive(name + " list", typed.remote);
  }
  if (name == "FILE" || name == "file") out.text += ":files\n";
  if (name == "type") out.text += list_directive("interface list", false);
  if (name == "targets") out.text += names_directive("targets", typed.remote);
  if (name == "parent" || name == "child") out.text += names_directive("frames", typed.remote);
  if (name == "controller") out.text += names_directive("controllers", typed.remote);
  if (name == "PAGE") {
    for (const std::string& page : document_names()) out.add(page, "a page of the documentation");
  }
  if (name == "VERB" || name == "PAGE") {
    const CLI::App* described = &app;  // help topic ...: the verbs of topic
    for (const std::string& word : typed.described) {
      const auto verbs = verbs_of(*described);
      const auto next = std::ranges::find(verbs, word, &CLI::App::get_name);
      if (next == verbs.end()) return;
      described = *next;
    }
    for (const CLI::App* verb : verbs_of(*described)) out.add(verb->get_name(), verb->get_description());
  }
  if (name != "TARGET" && name != "WORDS" && name != "A" && name != "B") return;
  for (const std::string& robot : bundled_robots()) out.add(robot, "a bundled robot");
  out.text += ":files\n";
}

std::string candidates(const CLI::App& app, std::vector<std::string> words) {
  Candidates out{words.empty() ? "" : words.back(), ""};
  if (!words.empty()) words.pop_back();
  const Typed typed = follow(app, words);
  if (typed.waiting != nullptr) {
    add_option_values(*typed.waiting, typed, out);
    return out.text;
  }
  if (out.current.starts_with('-')) {
    for (const CLI::Option* option : options_of(*typed.command)) {
      for (const std::string& name : option->get_lnames()) out.add("--" + name, option->get_description());
    }
    return out.text;
  }
  if (typed.positionals == 0) {
    for (const CLI::App* verb : verbs_of(*typed.command)) out.add(verb->get_name(), verb->get_description());
  }
  const auto positionals = positionals_of(*typed.command);
  if (positionals.empty()) return out.text;
  // The last one may take further words.
  add_positional_values(app, *positionals[std::min(typed.positionals, positionals.size() - 1)], typed, out);
  return out.text;
}

const char* script_of(const std::string& shell) {
  return shell == "zsh" ? kZshScript : shell == "fish" ? kFishScript : kBashScript;
}

// Hidden: used by the scripts.
void add_complete(CLI::App& app, int& exit_code) {
  const auto words = std::make_shared<std::vector<std::string>>();
  CLI::App* verb = app.add_subcommand("complete", "The words that may follow those behind --")->group("");
  verb->add_option("WORDS", *words);
  verb->callback([&app, words, &exit_code] {
    deliver(candidates(app, *words));
    exit_code = 0;
  });
}

}  // namespace

void add_completion(CLI::App& app, int& exit_code) {
  const auto shell = std::make_shared<std::string>("bash");
  CLI::App* verb =
      app.add_subcommand("completion", "Completion of verbs, options, robots and topics for a shell");
  verb->add_option("SHELL", *shell, "bash, zsh or fish")
      ->check(CLI::IsMember({"bash", "zsh", "fish"}))
      ->capture_default_str();
  verb->footer(
      "Examples:\n  source <(doppel completion)            # bash\n  source <(doppel completion zsh)        "
      "# zsh, after "
      "compinit\n  doppel completion fish | source        # fish");
  verb->callback([shell, &exit_code] {
    deliver(script_of(*shell));
    exit_code = 0;
  });
  add_complete(app, exit_code);
}

}  // namespace doppel::app
