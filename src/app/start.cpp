// doppel-xacro: the one verb as a program of its own, which starts without the physics and the server; the
// script `doppel` runs it for `doppel xacro`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>

#include "app/process.h"
#include "app/tell.h"
#include "app/verbs/verbs.h"
#include "doppel/core/diagnostic.h"

int main(int argc, char** argv) {
  constexpr int kBadInput = 2;
  doppel::app::fill_standard_files();
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app("Expands xacro files.", "doppel");
  app.require_subcommand(1);
  int exit_code = 0;
  doppel::app::add_xacro(app, exit_code);
  try {
    // The verb's own name goes in front where the program is called by it alone.
    std::vector<std::string> words(argv + 1, argv + argc);
    if (words.empty() || words.front() != "xacro") words.insert(words.begin(), "xacro");
    std::reverse(words.begin(), words.end());
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    doppel::app::tell("error: {}\n  mend: doppel xacro --help tells how it is used\n", error.what());
    return kBadInput;
  } catch (const doppel::InputError& error) {
    doppel::app::tell("{}\n", error.what());
    return kBadInput;
  } catch (const std::exception& error) {
    doppel::app::tell("error: {}\n", error.what());
    return 1;
  }
  return exit_code;
}
