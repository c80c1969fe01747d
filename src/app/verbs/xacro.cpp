// doppel xacro: expands a xacro file to the text that ros/xacro writes.
#include "doppel/description/xacro/xacro.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "app/output.h"
#include "app/print_stderr.h"
#include "app/process.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/installation.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct XacroOptions {
  std::vector<std::string> words;  // the file, and name:=value
  std::string output;
  int verbosity = 1;
  bool deps = false;
  bool ignored = false;  // options that ros/xacro accepts and ignores
};

struct ExpansionRequest {
  std::string file;
  std::vector<std::pair<std::string, std::string>> arguments;
};

[[noreturn]] void refuse_words(const std::string& message) {
  throw InputError("cli.use", {}, message, "doppel xacro --help shows its usage");
}

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
}

// As ros/xacro reads them: surrounding blanks are ignored, an empty value counts as not given, and _name is a
// node's private parameter, not an argument of xacro.
ExpansionRequest read_words(const std::vector<std::string>& words) {
  ExpansionRequest out;
  for (const std::string& word : words) {
    const std::size_t at = word.find(":=");
    if (at == std::string::npos) {
      if (!out.file.empty())
        refuse_words(fmt::format("only one file can be expanded at a time; '{}' is a second one", word));
      out.file = word;
      continue;
    }
    if (word.find(":=", at + 2) != std::string::npos)
      refuse_words(fmt::format("'{}' is not of the form name:=value", word));
    const std::string name = trimmed(word.substr(0, at)), value = trimmed(word.substr(at + 2));
    const bool node_parameter = name.size() > 1 && name[0] == '_' && name[1] != '_';
    if (!name.empty() && !value.empty() && !node_parameter) out.arguments.emplace_back(name, value);
  }
  if (out.file.empty()) refuse_words("no file to expand is given");
  return out;
}

void print_messages(const Diagnostics& diagnostics, int verbosity) {
  for (const Diagnostic& d : diagnostics.all()) {
    if (d.rule == "xacro.message" && d.severity == Severity::note)
      print_stderr("{}\n", d.message);
    else if (verbosity > 0)
      print_stderr("{}\n", d.str());
  }
}

std::string dependencies(const XacroResult& result) {
  std::string out;
  for (std::size_t i = 1; i < result.files.size(); ++i) out += (i > 1 ? " " : "") + result.files[i].string();
  return out;
}

int run_xacro(const XacroOptions& options) {
  const ExpansionRequest request = read_words(options.words);
  PackageResolver resolver;
  resolver.add_context(request.file);
  resolver.add_bundled(data_folder() / "robots");
  Diagnostics diagnostics;
  std::string text;
  try {
    const XacroResult result =
        expand_xacro(load_xml_tree(request.file), request.file, request.arguments, resolver, diagnostics);
    refuse_own_source(options.output, result.files, "write to another file, for instance build/arm.urdf");
    text = options.deps ? dependencies(result) : xacro_text(result.tree, request.file);
  } catch (const InputError&) {
    print_messages(diagnostics, options.verbosity);
    throw;
  }
  print_messages(diagnostics, options.verbosity);
  if (const fs::path place = options.output; place.has_parent_path()) {
    std::error_code none;
    fs::create_directories(place.parent_path(), none);
  }
  deliver(text, options.output);
  return 0;
}

}  // namespace

void add_xacro(CLI::App& app, int& exit_code) {
  CLI::App* verb = app.add_subcommand("xacro", "Expand a xacro file, as ros/xacro does");
  verb->footer(
      "Examples:\n  doppel xacro arm.urdf.xacro > arm.urdf\n  doppel xacro arm.urdf.xacro use_sim:=true "
      "prefix:=left_ -o build/left.urdf\n  doppel xacro arm.urdf.xacro --deps       # the files it includes "
      "and loads, for make and CMake\nSupported language and differences from xacro: doppel man xacro.md");
  const auto options = std::make_shared<XacroOptions>();
  verb->add_option("FILE", options->words, "File to expand, and name:=value for its <xacro:arg>s")
      ->required();
  verb->add_option("-o", options->output, "Write to this file instead of stdout; missing folders are created")
      ->type_name("FILE");
  verb->add_flag("--deps", options->deps, "Print the files it depends on instead of the expansion");
  verb->add_flag("-i,--inorder", options->ignored,
                 "Accepted for compatibility: in-order processing is the only mode since ROS 2");
  verb->add_flag_callback(
      "-q", [options] { options->verbosity = 0; }, "No warnings");
  verb->add_flag(
      "-v", [options](std::int64_t n) { options->verbosity += static_cast<int>(n); },
      "Accepted for compatibility: errors always show the whole path");
  verb->add_option("--verbosity", options->verbosity, "0: no warnings; 1: warnings")->type_name("LEVEL");
  verb->add_flag("--xacro-ns", options->ignored,
                 "Accepted for compatibility: xacro elements always need their prefix");
  verb->callback([options, &exit_code] { exit_code = run_xacro(*options); });
}

}  // namespace doppel::app
