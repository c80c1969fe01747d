#include "app/completion.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "app/command_tree.h"
#include "app/verbs/output.h"
#include "app/verbs/robots.h"

namespace doppel::app {
namespace {

// The scripts get candidates by `doppel complete -- WORDS`, of which the last one is incomplete. A line is a
// word and, behind a tab, its description; ":files" represents files, and ":VERB ..." the lines that
// this command prints.
constexpr const char* kBashScript = R"sh(# doppel's completion for bash: source <(doppel completion bash)
_doppel() {
  local current=${COMP_WORDS[COMP_CWORD]} line found arguments
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
  bool remote = false;
};

Typed follow(const CLI::App& app, const std::vector<std::string>& words) {
  Typed typed{&app};
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
      }
    }
  }
  return typed;
}

std::string list_directive(const std::string& list, bool remote) {
  return ":" + list + (remote ? " --remote\n" : "\n");
}

// The kind of values follows from the positional's name.
std::string values_of(const std::string& name, bool remote, const std::string& current) {
  if (name == "FILE" || name == "file") return ":files\n";
  for (const char* kind : {"topic", "service", "node", "action"}) {
    if (name == kind) return list_directive(name + " list", remote);
  }
  if (name == "type") return list_directive("interface list", false);
  if (name != "TARGET" && name != "WORDS" && name != "A" && name != "B") return "";
  std::string out;
  for (const std::string& robot : bundled_robots()) {
    if (robot.starts_with(current)) out += robot + "\ta bundled robot\n";
  }
  return out + ":files\n";
}

std::string candidates(const CLI::App& app, std::vector<std::string> words) {
  const std::string current = words.empty() ? "" : words.back();
  if (!words.empty()) words.pop_back();
  const Typed typed = follow(app, words);
  if (typed.waiting != nullptr) return ":files\n";
  std::string out;
  const auto add = [&](const std::string& word, const std::string& about) {
    if (word.starts_with(current)) out += fmt::format("{}\t{}\n", word, about.substr(0, about.find('\n')));
  };
  if (current.starts_with('-')) {
    for (const CLI::Option* option : options_of(*typed.command)) {
      for (const std::string& name : option->get_lnames()) add("--" + name, option->get_description());
    }
    return out;
  }
  if (typed.positionals == 0) {
    for (const CLI::App* verb : verbs_of(*typed.command)) add(verb->get_name(), verb->get_description());
  }
  const auto positionals = positionals_of(*typed.command);
  if (positionals.empty()) return out;
  // The last one may take further words.
  const CLI::Option* next = positionals[std::min(typed.positionals, positionals.size() - 1)];
  return out + values_of(next->get_name(true), typed.remote, current);
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
