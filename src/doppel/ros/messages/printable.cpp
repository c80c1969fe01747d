#include "doppel/ros/messages/printable.h"

#include "doppel/base/core/utf8.h"

namespace doppel {

std::string printable(std::string_view text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const Utf8Char c = next_utf8(text, at);
    const bool control = (c.code < 0x20 && c.code != '\n') || (c.code >= 0x7F && c.code < 0xA0);
    out += c.valid && !control ? text.substr(at, c.size) : "?";
    at += c.size;
  }
  return out;
}

bool is_printable_name(std::string_view name) {
  return printable(name) == name && name.find('\n') == std::string_view::npos &&
         name.find_first_not_of(' ') != std::string_view::npos;
}

}  // namespace doppel
