// doppel-start: run by the script `doppel` with the folder of the script. Builds what has changed, then
// replaces itself by the program. It runs the verb xacro itself, without the libraries of physics and server,
// whose loading would take longer than the work.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdlib>

#include "app/failures.h"
#include "app/print_stderr.h"
#include "app/process.h"
#include "app/start_check.h"
#include "app/verbs/verbs.h"

namespace {

using doppel::app::kBadInput;

[[noreturn]] void become_program(const std::string& root, char** words) {
  std::string program = root + "/build/bin/doppel";
  words[0] = program.data();
  execv(program.c_str(), words);
  doppel::app::print_stderr("error: cannot start '{}'; run tools/build doppel\n", program);
  std::exit(1);
}

int expand(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  CLI::App app("Expand xacro files.", "doppel");
  app.require_subcommand(1);
  int exit_code = 0;
  doppel::app::add_xacro(app, exit_code);
  return doppel::app::with_failures_reported([&] {
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      if (error.get_exit_code() == 0) return app.exit(error);
      doppel::app::print_stderr("error: {}\n  fix: doppel xacro --help shows its usage\n", error.what());
      return kBadInput;
    }
    return exit_code;
  });
}

}  // namespace

int main(int argc, char** argv) {
  doppel::app::fill_standard_files();
  if (argc < 2) {
    doppel::app::print_stderr(
        "error: doppel-start has to be run by the script doppel, with the folder of doppel as its "
        "argument\n");
    return kBadInput;
  }
  const std::string root = argv[1];
  setenv("DOPPEL_ROOT", root.c_str(), 1);
  // The words of the command, with the program's name in the place of the folder.
  char** const words = argv + 1;
  using doppel::app::Part;
  const Part part = doppel::app::part_for(argc > 2 ? argv[2] : "");
  if (doppel::app::must_build(root, part)) {
    if (const int failed = doppel::app::build(root, part)) return failed;
    become_program(root, words);  // not this one, which may have been rebuilt as well
  }
  if (part != Part::xacro) become_program(root, words);
  return expand(argc - 1, words);
}
