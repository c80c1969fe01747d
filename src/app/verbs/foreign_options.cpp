#include "app/verbs/foreign_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>

#include "app/print_stderr.h"
#include "doppel/base/core/diagnostic.h"

namespace doppel::app {
namespace {

// "--polling-interval" of "-p,--polling-interval".
std::string_view long_name(const ForeignOption& option) {
  const std::string_view names = option.name;
  return names.substr(names.find("--"));
}

void answer(const ForeignOption& option) {
  if (*option.refusal != '\0') {
    throw InputError("cli.use", {}, fmt::format("{} is not available: {}", long_name(option), option.refusal),
                     option.instead);
  }
  print_stderr("note: {} has no effect: {}\n", long_name(option), option.instead);
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
