#pragma once
// What a person is told, on stderr. It may be a file on a full disk or a terminal that is gone: what runs
// goes on all the same.

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
