#pragma once
// Output for the user, on stderr. It may be a file on a full disk or a closed terminal: the program continues
// in any case.

#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "app/output_writer.h"

namespace doppel::app {

// Any thread.
void write_stderr(std::string_view text);

template <class... Arguments>
void print_stderr(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  write_stderr(fmt::format(text, std::forward<Arguments>(arguments)...));
}

// While it lives, no thread of the program waits in write_stderr(). One at a time.
class StderrWriter {
 public:
  StderrWriter();
  ~StderrWriter();
  StderrWriter(const StderrWriter&) = delete;
  StderrWriter& operator=(const StderrWriter&) = delete;

 private:
  OutputWriter writer_;
};

}  // namespace doppel::app
