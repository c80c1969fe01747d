#include "app/man_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>

#include "app/command_tree.h"
#include "app/documents.h"
#include "app/output.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/version.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct ManOptions {
  std::string page, folder;
};

// Text for roff: no escapes, no requests at the start of a line, ASCII hyphens that can be copied.
std::string roff(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const bool starts_line = out.empty() || out.back() == '\n';
    if (starts_line && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if (c == '`' || c == '\'') {
      out += c == '`' ? "\\(ga" : "\\(aq";
    } else {
      out += c;
    }
  }
  return out;
}

std::string heading(const std::string& name) {
  return fmt::format(".SH {}\n", name);
}

std::string placeholder(const CLI::Option& option) {
  std::string type = option.get_type_name();
  if (const std::size_t end = type.find_first_of(":[ "); end != std::string::npos) type.resize(end);
  return type.empty() ? "VALUE" : type;
}

std::string option_entry(const CLI::Option& option) {
  std::string names;
  const auto add = [&](const std::string& name) {
    names += fmt::format("{}\\fB{}\\fR", names.empty() ? "" : ", ", roff(name));
  };
  for (const std::string& name : option.get_snames()) add("-" + name);
  for (const std::string& name : option.get_lnames()) add("--" + name);
  if (takes_value(option)) names += fmt::format(" \\fI{}\\fR", roff(placeholder(option)));
  std::string about = option.get_description();
  if (!option.get_default_str().empty()) about += fmt::format(" (default: {})", option.get_default_str());
  return fmt::format(".TP\n{}\n{}\n", names, roff(about));
}

std::string positional_entry(const CLI::Option& option) {
  return fmt::format(".TP\n\\fI{}\\fR\n{}\n", roff(option.get_name(true)), roff(option.get_description()));
}

std::string synopsis(const CLI::App& command, const std::string& path) {
  std::string line = fmt::format(".B {}\n[\\fIOPTIONS\\fR]", roff(path));
  if (!verbs_of(command).empty()) line += " \\fIVERB\\fR ...";
  for (const CLI::Option* positional : positionals_of(command)) {
    const std::string name = fmt::format("\\fI{}\\fR", roff(positional->get_name(true)));
    line += positional->get_required() ? " " + name : " [" + name + "]";
    if (positional->get_items_expected_max() > 1) line += " ...";
  }
  return line + "\n";
}

std::string details(const CLI::App& command) {
  std::string out;
  for (const CLI::Option* positional : positionals_of(command)) {
    if (!positional->get_group().empty()) out += positional_entry(*positional);
  }
  for (const CLI::Option* option : options_of(command)) out += option_entry(*option);
  return out;
}

// The text at the end of --help, unchanged.
std::string examples(const CLI::App& command) {
  const std::string footer = command.get_footer();
  return footer.empty() ? "" : fmt::format(".nf\n{}\n.fi\n", roff(footer));
}

std::string first_lines(const std::string& page, const std::string& about) {
  std::string title = page;
  std::ranges::transform(title, title.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return fmt::format(".TH {} 1 \"\" \"doppel {}\" \"doppel\"\n{}{} \\- {}\n", roff(title), version(),
                     heading("NAME"), roff(page), roff(about));
}

std::string main_page(const CLI::App& app) {
  std::string out = first_lines("doppel", app.get_description()) + heading("SYNOPSIS") +
                    synopsis(app, "doppel") + heading("OPTIONS") + details(app) + heading("VERBS");
  for (const CLI::App* verb : verbs_of(app)) {
    out += fmt::format(".TP\n.BR {} (1)\n{}\n", roff("doppel-" + verb->get_name()),
                       roff(verb->get_description()));
  }
  out += heading("EXAMPLES") + examples(app);
  return out + heading("EXIT STATUS") +
         ".TP\n0\nit went well\n.TP\n1\nit failed, or the check has found errors\n.TP\n2\nthe input cannot "
         "be used; the "
         "message says what, where and what to do\n";
}

std::string verb_page(const CLI::App& verb) {
  const std::string path = "doppel " + verb.get_name();
  std::string out = first_lines("doppel-" + verb.get_name(), verb.get_description()) + heading("SYNOPSIS") +
                    synopsis(verb, path) + heading("OPTIONS") + details(verb);
  for (const CLI::App* sub : verbs_of(verb)) {
    const std::string sub_path = path + " " + sub->get_name();
    out += fmt::format(".SH \"{}\"\n{}\n.PP\n{}{}", roff(sub_path), roff(sub->get_description()),
                       synopsis(*sub, sub_path), details(*sub));
    if (const std::string shown = examples(*sub); !shown.empty()) out += ".PP\n" + shown;
  }
  if (const std::string shown = examples(verb); !shown.empty()) out += heading("EXAMPLES") + shown;
  return out + heading("SEE ALSO") + ".BR doppel (1)\n";
}

// The build writes all pages, so that a build fails for a tree of verbs that another release's CLI11 refuses.
void require_distinct_names(const CLI::App& app) {
  const std::vector<std::string> shared = shared_names(app);
  if (shared.empty()) return;
  throw InputError("cli.shared_names", {},
                   fmt::format("one name is two arguments of a verb: {}", fmt::join(shared, ", ")),
                   "rename the positional: CLI11 2.4 and later refuse the whole command line");
}

int write_all(const CLI::App& app, const fs::path& folder) {
  require_distinct_names(app);
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) {
    throw InputError("output.unwritable", make_location(folder.string()),
                     fmt::format("the folder cannot be made: {}", failed.message()), "choose another folder");
  }
  deliver(main_page(app), folder / "doppel.1");
  for (const CLI::App* verb : verbs_of(app))
    deliver(verb_page(*verb), folder / fmt::format("doppel-{}.1", verb->get_name()));
  return 0;
}

int run_man(const CLI::App& app, const ManOptions& options) {
  if (!options.folder.empty()) return write_all(app, options.folder);
  if (options.page.empty()) {
    deliver(main_page(app));
    return 0;
  }
  std::vector<std::string> names;
  for (const CLI::App* verb : verbs_of(app)) {
    names.push_back(verb->get_name());
    if (verb->get_name() != options.page) continue;
    deliver(verb_page(*verb));
    return 0;
  }
  if (const std::string text = document_text(options.page); !text.empty()) {
    deliver(text);
    return 0;
  }
  for (const std::string& name : document_names()) {
    names.push_back(name);
    names.push_back(fs::path(name).stem().string());
  }
  const auto near = nearest_name(options.page, names);
  throw InputError("cli.use", {},
                   fmt::format("'{}' is neither a verb of doppel nor a page of its documentation{}",
                               options.page, near ? fmt::format("; did you mean '{}'?", *near) : ""),
                   "'doppel man README.md' lists the pages");
}

}  // namespace

void add_man(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ManOptions>();
  CLI::App* verb =
      app.add_subcommand("man", "Print the manual page of a verb, or a page of the documentation");
  CLI::Option* name = verb->add_option("PAGE", options->page,
                                       "A verb, a page of the documentation (worlds.md; README.md lists "
                                       "them), or the name that an error prints in "
                                       "brackets; default: the program");
  verb->add_option("--into", options->folder, "Write all pages into this folder: doppel.1, doppel-up.1, ...")
      ->excludes(name);
  verb->footer(
      "Examples:\n  doppel man | man -l -\n  doppel man up | man -l -\n  doppel man worlds.md\n  doppel man "
      "server.port_taken\n  doppel man --into "
      "~/.local/share/man/man1");
  verb->callback([&app, options, &exit_code] { exit_code = run_man(app, *options); });
}

}  // namespace doppel::app
