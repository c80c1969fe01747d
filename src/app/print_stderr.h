#pragma once
// Output for the user, on stderr. It may be a file on a full disk or a closed terminal: the program continues
// in any case.

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

namespace doppel::app {

template <class... Arguments>
void print_stderr(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  const std::string line = fmt::format(text, std::forward<Arguments>(arguments)...);
  std::fwrite(line.data(), 1, line.size(), stderr);
}

}  // namespace doppel::app
