#include "app/output.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/output_file.h"
#include "doppel/base/core/shown_path.h"

namespace doppel::app {

void deliver(std::string_view text, const std::string& file) {
  if (!file.empty() && file != "-") return write_whole(file, text);
  if (write_all(STDOUT_FILENO, text) || errno == EPIPE) return;
  throw InputError("output.unwritable", make_location("stdout"),
                   fmt::format("cannot write the output: {}", std::strerror(errno)),
                   "free disk space, or write elsewhere");
}

void check_output(const std::string& file) {
  if (!file.empty() && file != "-") check_writable(file);
}

void refuse_own_source(const std::string& file, std::span<const std::filesystem::path> sources,
                       const std::string& fix) {
  if (file.empty() || file == "-") return;
  for (const std::filesystem::path& source : sources) {
    std::error_code none;
    if (!std::filesystem::equivalent(file, source, none)) continue;
    throw InputError("output.own_source", make_location(file),
                     fmt::format("the description is read from this file{}; the output would overwrite it",
                                 shown_path(source) == file ? "" : fmt::format(" ({})", shown_path(source))),
                     fix);
  }
}

}  // namespace doppel::app
