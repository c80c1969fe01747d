// doppel diff: the changes that a new export, or another edit, makes to the robot.
#include <unistd.h>

#include <algorithm>
#include <map>

#include "app/description_target.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/review/comparison/comparison.h"

namespace doppel::app {
namespace {

struct DiffOptions {
  std::string a, b;
  std::vector<std::string> arguments;
  bool json = false, raw = false;
  std::string color = "auto";
};

LoadedDescription load_side(const std::string& words, const DiffOptions& options) {
  XacroArguments arguments;
  for (const std::string& text : options.arguments) arguments.push_back(split_argument(text));
  DescriptionTarget target = open_target(words, arguments);
  if (!options.raw) return load_target(target);
  Diagnostics diagnostics;
  LoadedDescription loaded =
      load_description(target.target.description, target.arguments, target.resolver, diagnostics);
  print_diagnostics(diagnostics);
  return loaded;
}

class Printer {
 public:
  Printer(const std::vector<Change>& changes, bool colour) : changes_(changes), colour_(colour) {}

  void print() {
    for (std::size_t i = 0; i < changes_.size(); ++i) {
      const Change& change = changes_[i];
      const bool same_subject =
          i > 0 && changes_[i - 1].subject == change.subject && changes_[i - 1].name == change.name;
      if (!same_subject) heading(change);
      if (!change.aspect.empty()) aspect(change, widest(i));
    }
    summary();
  }

 private:
  [[nodiscard]] std::string painted(const char* code, const std::string& text) const {
    return colour_ ? fmt::format("\x1b[{}m{}\x1b[0m", code, text) : text;
  }

  void heading(const Change& change) {
    const bool added = change.kind == Change::Kind::added, removed = change.kind == Change::Kind::removed;
    const std::string sign = added ? painted("32", "+") : removed ? painted("31", "-") : painted("33", "~");
    const std::string& what = added ? change.to : change.from;
    std::string line = fmt::format("{} {:<12} {}", sign, change.subject, change.name);
    if ((added || removed) && !what.empty()) line += fmt::format("  ({})", what);
    print_line("{}\n", line);
  }

  void aspect(const Change& change, std::size_t width) {
    const std::string arrow =
        change.from.empty() ? change.to : fmt::format("{} -> {}", change.from, change.to);
    const std::string meaning = change.meaning.empty() ? "" : painted("36", "  " + change.meaning);
    print_line("    {:<{}}  {}{}\n", change.aspect, width, arrow, meaning);
  }

  // Aspects of one subject are aligned in one column.
  [[nodiscard]] std::size_t widest(std::size_t at) const {
    std::size_t width = 8;
    for (const Change& change : changes_) {
      if (change.subject == changes_[at].subject && change.name == changes_[at].name)
        width = std::max(width, change.aspect.size());
    }
    return width;
  }

  void summary() {
    std::map<std::string, int> subjects;
    std::string last;
    for (const Change& change : changes_) {
      const std::string key = change.subject + "\n" + change.name;
      if (key != last && change.subject != "robot") ++subjects[change.subject];
      last = key;
    }
    std::string text;
    int all = 0;
    for (const auto& [subject, count] : subjects) {
      all += count;
      text += fmt::format("{}{} {}{}", text.empty() ? "" : ", ", count, subject,
                          count == 1 || subject == "ros2_control" ? "" : "s");
    }
    print_line("{}\n", changes_.empty() ? "the same machine"
                       : text.empty()   ? "the robot as a whole differs"
                                        : text + (all == 1 ? " differs" : " differ"));
  }

  const std::vector<Change>& changes_;
  bool colour_;
};

int run_diff(const DiffOptions& options) {
  const LoadedDescription a = load_side(options.a, options), b = load_side(options.b, options);
  const std::vector<Change> changes = compare(a.robot, b.robot);
  try {
    if (options.json) {
      print_line("{}\n", to_json(changes));
    } else {
      const bool colour =
          options.color == "always" || (options.color == "auto" && isatty(STDOUT_FILENO) != 0);
      Printer(changes, colour).print();
    }
  } catch (const OutputClosed&) {  // stdout was closed (| head); the exit code stays
  }
  return changes.empty() ? 0 : 1;
}

}  // namespace

void add_diff(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DiffOptions>();
  CLI::App* verb = app.add_subcommand("diff", "Compare two descriptions by what they mean");
  verb->add_option("A", options->a, "Name of a bundled robot, a .urdf or .xacro file, or a package folder")
      ->required();
  verb->add_option("B", options->b, "Description to compare it with")->required();
  verb->add_option("--set", options->arguments, "xacro argument for both, name:=value")->take_all();
  verb->add_flag("--raw", options->raw, "Compare without overlays");
  verb->add_flag("--json", options->json, "Print a JSON object to stdout");
  verb->add_option("--color", options->color, "Colour: auto, always or never")
      ->check(CLI::IsMember({"auto", "always", "never"}));
  verb->footer(
      "Exit code: 0 no difference, 1 they differ, 2 one cannot be read.\nExamples:\n  doppel diff "
      "exported/arm.urdf my_arm.xacro\n  doppel diff robots/omarm_one/export/urdf/omarm.xacro omarm_one "
      "--color always | less -R");
  verb->callback([options, &exit_code] { exit_code = run_diff(*options); });
}

}  // namespace doppel::app
