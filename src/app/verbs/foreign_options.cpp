#include "app/verbs/foreign_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>

#include "app/print_stderr.h"
#include "doppel/base/core/diagnostic.h"

namespace doppel::app {
namespace {

void answer(const ForeignOption& option) {
  if (*option.refusal != '\0') {
    throw InputError("cli.use", {}, fmt::format("{} is not available: {}", option.name, option.refusal),
                     option.instead);
  }
  print_stderr("note: {} has no effect: {}\n", option.name, option.instead);
}

}  // namespace

void add_foreign_options(CLI::App& verb, std::span<const ForeignOption> options) {
  for (const ForeignOption& option : options) {
    if (option.values == 0) {
      verb.add_flag_callback(option.name, [&option] { answer(option); })->group("");
    } else {
      verb.add_option_function<std::string>(option.name, [&option](const std::string&) { answer(option); })
          ->group("");
    }
  }
}

}  // namespace doppel::app
