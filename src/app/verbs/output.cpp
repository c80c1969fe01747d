#include "app/verbs/output.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "doppel/core/diagnostic.h"
#include "doppel/core/output_file.h"

namespace doppel::app {

void deliver(std::string_view text, const std::string& file) {
  if (!file.empty() && file != "-") return write_whole(file, text);
  while (!text.empty()) {
    const ssize_t written = write(STDOUT_FILENO, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0 && errno == EPIPE) return;
    if (written < 0) {
      throw InputError("output.unwritable", make_location("stdout"),
                       fmt::format("the output cannot be written: {}", std::strerror(errno)),
                       "make room, or write elsewhere");
    }
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace doppel::app
