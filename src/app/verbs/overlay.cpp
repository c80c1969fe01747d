// doppel overlay: shows, adds and removes corrections of a description, and bakes them into its sources.
#include "doppel/description/overlay/overlay.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "app/description_target.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/description/overlay/bake.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct OverlayOptions {
  std::vector<std::string> words, evidence;
  std::string why, output;
  bool json = false, in_place = false, dry_run = false;
};

// A description without its corrections, the overlays of included files and its own, and the result of
// applying them.
struct Corrected {
  explicit Corrected(const std::vector<std::string>& words) : target(open_target(words)) {
    plain = expand_description(target.target.description, target.arguments, target.resolver, diagnostics);
    basis = plain;
    included = apply_included_overlays(basis, target.resolver, diagnostics);
    corrected = basis;
    const fs::path file = overlay_path(target.target.description);
    overlay.file = file;
    if (!fs::exists(file)) return;
    overlay = read_overlay(file);
    outcomes = apply_overlay(overlay, corrected, target.resolver, diagnostics);
  }
  // The description after the operations before the i-th.
  [[nodiscard]] ExpandedDescription before(std::size_t i) const {
    ExpandedDescription out = basis;
    Overlay first = overlay;
    first.operations.resize(i);
    Diagnostics quiet;
    apply_overlay(first, out, target.resolver, quiet);
    return out;
  }

  DescriptionTarget target;
  Diagnostics diagnostics;
  ExpandedDescription plain, basis, corrected;  // basis: with the overlays of included files only
  std::vector<AppliedOverlay> included;
  Overlay overlay;
  std::vector<OperationOutcome> outcomes;
};

constexpr std::array kStates{OperationState::applied,        OperationState::already_there,
                             OperationState::changed,        OperationState::no_target,
                             OperationState::no_fingerprint, OperationState::superseded};

bool is_effective(OperationState state) {
  return state == OperationState::applied || state == OperationState::already_there ||
         state == OperationState::superseded;
}

bool all_effective(const std::vector<OperationOutcome>& outcomes) {
  return std::ranges::all_of(outcomes, [](const auto& outcome) { return is_effective(outcome.state); });
}

std::size_t count_of(const std::vector<OperationOutcome>& outcomes, OperationState state) {
  return static_cast<std::size_t>(std::ranges::count(outcomes, state, &OperationOutcome::state));
}

std::string counts(const std::vector<OperationOutcome>& outcomes) {
  std::string out;
  for (const OperationState state : kStates) {
    if (const std::size_t n = count_of(outcomes, state); n > 0)
      out += fmt::format("{}{} {}", out.empty() ? "" : ", ", n, to_string(state));
  }
  return out;
}

std::string coloured(OperationState state, bool colour) {
  const std::string text = fmt::format("{:<16}", to_string(state));
  if (!colour) return text;
  const int code = state == OperationState::applied ? 32 : state == OperationState::already_there ? 90 : 33;
  return fmt::format("\033[{}m{}\033[0m", code, text);
}

std::string operations_text(const Overlay& overlay, const std::vector<OperationOutcome>& outcomes) {
  const bool colour = isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr;
  std::string out;
  for (std::size_t i = 0; i < overlay.operations.size(); ++i) {
    const Operation& operation = overlay.operations[i];
    const OperationOutcome& outcome = outcomes[i];
    out += fmt::format("{:>3}  {}{}\n", i + 1, coloured(outcome.state, colour), describe(operation.action));
    const auto line = [&](const char* name, const std::string& text) {
      if (!text.empty()) out += fmt::format("{:>21}{:<10}{}\n", "", name, text);
    };
    if (!is_effective(outcome.state)) line("problem", outcome.message);
    line("why", operation.why);
    for (const std::string& evidence : operation.evidence) line("evidence", evidence);
  }
  return out;
}

std::string show_text(const Corrected& c) {
  std::string out;
  for (const AppliedOverlay& one : c.included) {
    out +=
        fmt::format("{}, beside the included {}{}: {}\n", one.overlay.file.string(), one.description.string(),
                    one.prefix.empty() ? "" : fmt::format(", for names that begin with '{}'", one.prefix),
                    counts(one.outcomes));
    out += operations_text(one.overlay, one.outcomes);
  }
  if (c.overlay.operations.empty()) {
    return out + fmt::format("{} has no corrections{} ({} {})\n", c.target.target.description.string(),
                             c.included.empty() ? "" : " of its own", c.overlay.file.string(),
                             fs::exists(c.overlay.file) ? "is empty" : "does not exist");
  }
  out += fmt::format("{}: {}\n", c.overlay.file.string(), counts(c.outcomes));
  return out + operations_text(c.overlay, c.outcomes);
}

nlohmann::ordered_json operations_json(const Overlay& overlay,
                                       const std::vector<OperationOutcome>& outcomes) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < overlay.operations.size(); ++i) {
    const Operation& operation = overlay.operations[i];
    nlohmann::ordered_json one;
    one["number"] = i + 1;
    one["operation"] = operation_name(operation.action);
    one["target"] = target_name(operation.action);
    one["text"] = describe(operation.action);
    one["state"] = to_string(outcomes[i].state);
    one["message"] = outcomes[i].message;
    one["why"] = operation.why;
    one["evidence"] = operation.evidence;
    one["was"] = nlohmann::ordered_json::object();
    for (const auto& [key, value] : operation.was) one["was"][key] = value;
    one["line"] = operation.where.line;
    out.push_back(std::move(one));
  }
  return out;
}

std::string show_json(const Corrected& c) {
  nlohmann::ordered_json out;
  out["version"] = 1;
  out["description"] = c.target.target.description.string();
  out["file"] = c.overlay.file.string();
  out["operations"] = operations_json(c.overlay, c.outcomes);
  for (const OperationState state : kStates)
    out["counts"][std::string(to_string(state))] = count_of(c.outcomes, state);
  out["included"] = nlohmann::ordered_json::array();
  for (const AppliedOverlay& one : c.included) {
    out["included"].push_back({{"description", one.description.string()},
                               {"file", one.overlay.file.string()},
                               {"prefix", one.prefix},
                               {"operations", operations_json(one.overlay, one.outcomes)}});
  }
  return out.dump(2) + "\n";
}

int show_overlay(const OverlayOptions& o) {
  const Corrected c(o.words);
  deliver(o.json ? show_json(c) : show_text(c));
  const bool good =
      all_effective(c.outcomes) &&
      std::ranges::all_of(c.included, [](const AppliedOverlay& one) { return all_effective(one.outcomes); });
  return good ? 0 : 1;
}

// -- add, remove, stamp
std::string yaml_quoted(const std::string& text) {
  return nlohmann::json(text).dump();  // JSON's strings are YAML's double-quoted ones
}

// TARGET OPERATION [NAME] [key=value ...], with xacro's name:=value among them.
struct AddWords {
  std::vector<std::string> target;
  std::string operation, name;
  std::vector<std::pair<std::string, std::string>> settings;
};

AddWords split_words(const std::vector<std::string>& words) {
  AddWords out;
  bool named = false;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::size_t equals = words[i].find('=');
    if (i == 0 || words[i].find(":=") != std::string::npos) {
      out.target.push_back(words[i]);
    } else if (out.operation.empty()) {
      out.operation = words[i];
    } else if (!named && equals == std::string::npos) {
      out.name = words[i];
      named = true;
    } else if (equals != std::string::npos && equals > 0) {
      out.settings.emplace_back(words[i].substr(0, equals), words[i].substr(equals + 1));
    } else {
      throw InputError("cli.use", {}, fmt::format("'{}' is not of the form key=value", words[i]),
                       "quote a name that contains spaces, and write settings as offset=\"45 deg\"");
    }
  }
  if (out.operation.empty()) {
    throw InputError("cli.use", {}, "no operation is given",
                     "for example: doppel overlay add my_arm.xacro flip_axis \"Revolute 3\"");
  }
  return out;
}

Operation read_operation(const AddWords& words, const OverlayOptions& o) {
  std::string yaml =
      fmt::format("- {}: {}\n", words.operation, words.name.empty() ? "" : yaml_quoted(words.name));
  for (const auto& [key, value] : words.settings) {
    const bool structured = value.starts_with('[') || value.starts_with('{');
    yaml += fmt::format("  {}: {}\n", key, structured ? value : yaml_quoted(value));
  }
  Operation operation = parse_overlay(yaml, "command line").operations.at(0);
  operation.why = o.why;
  operation.evidence = o.evidence;
  operation.where = {};
  return operation;
}

// Errors of the description, and parts that its reader leaves out. A correction must not add any.
std::vector<Diagnostic> errors_of(const Corrected& c) {
  Diagnostics reported;
  PackageResolver resolver = c.target.resolver;
  try {
    read_description(c.corrected, resolver, reported);
  } catch (const InputError& error) {
    for (const Diagnostic& diagnostic : error.diagnostics()) reported.add(diagnostic);
  }
  std::vector<Diagnostic> out = reported.all();
  std::erase_if(out, [](const Diagnostic& d) {
    const bool left_out = d.severity == Severity::warning && d.rule.starts_with("urdf.");
    return d.severity != Severity::error && !left_out;
  });
  return out;
}

void refuse_new_errors(const std::vector<Diagnostic>& before, const Corrected& c, const Operation& added) {
  for (const Diagnostic& now : errors_of(c)) {
    const auto known = [&](const Diagnostic& d) { return d.rule == now.rule && d.message == now.message; };
    if (std::ranges::any_of(before, known)) continue;
    throw InputError("overlay.nonsense", now.where,
                     fmt::format("'{}' would break the description: {}", describe(added.action), now.message),
                     now.fix);
  }
}

// When a robot is loaded these are warnings; when a correction is added they are errors.
void throw_warnings_as_errors(const Diagnostics& reported) {
  std::vector<Diagnostic> refused;
  for (Diagnostic diagnostic : reported.all()) {
    static const std::vector<std::string> kOfStates{"overlay.already_there", "overlay.changed",
                                                    "overlay.no_target", "overlay.no_fingerprint"};
    if (std::ranges::find(kOfStates, diagnostic.rule) != kOfStates.end()) continue;
    diagnostic.severity = Severity::error;
    refused.push_back(std::move(diagnostic));
  }
  if (!refused.empty()) throw InputError(std::move(refused));
}

int add(const OverlayOptions& o) {
  const AddWords words = split_words(o.words);
  Operation operation = read_operation(words, o);
  Corrected c(words.target);
  take_fingerprint(operation, c.corrected);
  const std::vector<Diagnostic> before = errors_of(c);
  Overlay one;
  one.operations = {operation};
  Diagnostics reported;
  const OperationOutcome outcome = apply_overlay(one, c.corrected, c.target.resolver, reported).front();
  throw_warnings_as_errors(reported);
  if (outcome.state != OperationState::applied) {
    throw InputError(
        "overlay.nothing_to_do", {},
        fmt::format("'{}' would change nothing: {}", describe(operation.action), outcome.message));
  }
  refuse_new_errors(before, c, operation);
  const fs::path file = add_to_overlay(c.target.target.description, {operation});
  print_stderr("{}: {}\n", file.string(), describe(operation.action));
  return 0;
}

// A number at the end of the words: which operation. 0: none was given.
std::size_t take_number(std::vector<std::string>& words) {
  std::size_t number = 0;
  const std::string& last = words.back();
  const auto [end, problem] = std::from_chars(last.data(), last.data() + last.size(), number);
  if (words.size() < 2 || problem != std::errc() || end != last.data() + last.size()) return 0;
  if (number == 0) throw InputError("cli.use", {}, "operations are numbered from 1");
  words.pop_back();
  return number;
}

std::size_t checked_index(const Corrected& c, std::size_t number) {
  if (number >= 1 && number <= c.overlay.operations.size()) return number - 1;
  throw InputError("cli.use", {},
                   fmt::format("there is no operation {}; {} has {}", number, c.overlay.file.string(),
                               c.overlay.operations.size()),
                   "'doppel overlay show' prints their numbers");
}

int remove_operation(const OverlayOptions& o) {
  std::vector<std::string> words = o.words;
  const std::size_t number = take_number(words);
  if (number == 0) {
    throw InputError("cli.use", {}, "no operation is given",
                     "doppel overlay remove TARGET N; 'doppel overlay show' prints their numbers");
  }
  const Corrected c(words);
  const std::size_t i = checked_index(c, number);
  remove_from_overlay(c.overlay, i);
  print_stderr("{}: removed: {}\n", c.overlay.file.string(), describe(c.overlay.operations[i].action));
  return 0;
}

bool stamp_one(const Corrected& c, std::size_t i) {
  Operation operation = c.overlay.operations[i];
  take_fingerprint(operation, c.before(i));
  stamp_overlay(c.overlay, i, operation);
  print_stderr("{}: fingerprint of the current description: {}\n", c.overlay.file.string(),
               describe(operation.action));
  return true;
}

int stamp(const OverlayOptions& o) {
  std::vector<std::string> words = o.words;
  if (const std::size_t number = take_number(words); number != 0) {
    const Corrected c(words);
    stamp_one(c, checked_index(c, number));
    return 0;
  }
  bool stamped = false;
  for (std::size_t i = 0;; ++i) {
    const Corrected c(words);  // again: each operation's fingerprint depends on the previous ones
    if (i >= c.overlay.operations.size()) break;
    if (c.overlay.operations[i].was.empty()) stamped = stamp_one(c, i);
  }
  if (!stamped) print_stderr("every operation has its fingerprint\n");
  return 0;
}

// -- bake
std::string package_name(const fs::path& folder) {
  const XmlNode root = load_xml((folder / "package.xml").string());
  const XmlNode* name = root.first("name");
  return name != nullptr ? name->content() : "";
}

void copy_meshes(const std::vector<std::pair<fs::path, fs::path>>& copies) {
  for (const auto& [from, to] : copies) {
    std::error_code problem;
    fs::create_directories(to.parent_path(), problem);
    fs::copy_file(from, to, fs::copy_options::overwrite_existing, problem);
    if (problem) {
      throw InputError("file.unwritable", make_location(to.string()),
                       fmt::format("cannot write '{}': {}", to.string(), problem.message()));
    }
    print_stderr("{}: written\n", to.string());
  }
}

// Moves generated meshes to a permanent place: in the package, or beside the written file.
void settle(Corrected& c, const fs::path& beside) {
  const fs::path& package = c.target.target.package_folder;
  const std::string name = package.empty() ? "" : package_name(package);
  const fs::path folder = name.empty() ? beside : package;
  copy_meshes(
      settle_meshes(c.corrected.root, folder, name.empty() ? "" : fmt::format("package://{}/", name)));
}

void report_fully_baked(const Corrected& c) {
  if (all_effective(c.outcomes) && !c.outcomes.empty())
    print_stderr("{}: every correction is now in the sources; this file can be deleted\n",
                 shown_path(c.overlay.file));
}

int bake_sources(Corrected& c, const OverlayOptions& o) {
  std::vector<BakedFile> files = bake_in_place(c.plain, c.corrected);
  if (files.empty()) {
    print_stderr("there is nothing to bake: {}\n",
                 c.outcomes.empty() ? "no corrections" : counts(c.outcomes));
    report_fully_baked(c);
    return 0;
  }
  if (!o.dry_run) {
    write_baked(files, [&] {
      Diagnostics quiet;
      const ExpandedDescription now =
          expand_description(c.plain.file, c.target.arguments, c.target.resolver, quiet);
      return same_expansion(now.root, c.corrected.root);
    });
  }
  for (const BakedFile& file : files)
    print_stderr("{}: {}\n", shown_path(file.file), o.dry_run ? "would be patched" : "patched");
  if (!o.dry_run) report_fully_baked(c);
  return 0;
}

int bake(const OverlayOptions& o) {
  if (o.output.empty() == !o.in_place) {
    throw InputError("cli.use", {}, "no output is given",
                     "-o FILE writes plain URDF, --in-place patches the sources themselves");
  }
  Corrected c(o.words);
  print_diagnostics(c.diagnostics);
  c.diagnostics.throw_if_errors();
  const fs::path file = o.in_place ? c.plain.file : fs::path(o.output);
  if (!o.in_place) {
    std::vector<fs::path> sources = c.basis.files;
    sources.push_back(c.overlay.file);
    refuse_own_source(o.output, sources, "write to another file, or patch the sources with --in-place");
  }
  if (!o.dry_run) settle(c, fs::absolute(file).parent_path());
  if (o.in_place) return bake_sources(c, o);
  if (!o.dry_run) deliver(to_xml(c.corrected.root), o.output);
  return 0;
}

CLI::App* add_part(CLI::App& group, const char* name, const char* help, int& exit_code,
                   const std::shared_ptr<OverlayOptions>& options, int (*run)(const OverlayOptions&)) {
  CLI::App* verb = group.add_subcommand(name, help);
  verb->callback([options, &exit_code, run] { exit_code = run(*options); });
  return verb;
}

}  // namespace

void add_overlay(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<OverlayOptions>();
  OverlayOptions& o = *options;
  CLI::App* group = app.add_subcommand("overlay", "Manage corrections that survive the next export");
  group->require_subcommand(1);
  group->footer("File format and all operations: doppel man overlay.md");

  CLI::App* verb =
      add_part(*group, "show", "List the corrections with their state; exit code 1 if one is not applied",
               exit_code, options, show_overlay);
  add_target(*verb, o.words);
  verb->add_flag("--json", o.json, "Print a JSON object to stdout");

  verb = add_part(*group, "add", "Add a correction with its fingerprint", exit_code, options, add);
  verb->add_option("WORDS", o.words, "TARGET OPERATION [NAME] [key=value ...]")->required();
  verb->add_option("--why", o.why, "Reason for the correction");
  verb->add_option("--evidence", o.evidence, "Evidence: what was measured or read; repeatable")
      ->take_all()
      ->allow_extra_args(false);
  verb->footer(
      "Examples:\n"
      "  doppel overlay add arm.xacro flip_axis \"Revolute 3\" --why \"it turns the other way\"\n"
      "  doppel overlay add arm.xacro bake_zero \"Revolute 2\" offset=\"45 deg\"\n"
      "  doppel overlay add arm.xacro set_limit \"Revolute 1\" effort=3.5 velocity=5.2 --evidence \"DS3240's "
      "sheet\"");

  verb = add_part(*group, "remove", "Remove correction N", exit_code, options, remove_operation);
  verb->add_option("WORDS", o.words, "TARGET N, the number printed by 'overlay show'")->required();

  verb =
      add_part(*group, "stamp", "Add fingerprints to corrections written by hand", exit_code, options, stamp);
  verb->add_option("WORDS", o.words, "TARGET [N]; with N only this one, even if it already has a fingerprint")
      ->required();

  verb = add_part(*group, "bake", "Write the corrections to a URDF file or into the sources", exit_code,
                  options, bake);
  add_target(*verb, o.words);
  verb->add_option("-o", o.output, "Write URDF to this file; - is stdout")->type_name("FILE");
  verb->add_flag("--in-place", o.in_place,
                 "Patch the sources, all of them or none; comments and layout are kept");
  verb->add_flag("--dry-run", o.dry_run, "List the files that would change without writing");
}

}  // namespace doppel::app
