#include "doppel/base/xml/detail/xml_encoding.h"

#include <algorithm>
#include <charconv>

#include "doppel/base/core/utf8.h"

namespace doppel {
namespace {

std::string from_utf16(std::string_view bytes, bool big) {
  const auto unit = [&](std::size_t i) {
    const auto a = static_cast<unsigned char>(bytes[i]), b = static_cast<unsigned char>(bytes[i + 1]);
    return static_cast<char32_t>(big ? a << 8 | b : b << 8 | a);
  };
  std::string out;
  for (std::size_t i = 2; i + 1 < bytes.size(); i += 2) {
    char32_t code = unit(i);
    if (code >= 0xD800 && code < 0xDC00 && i + 3 < bytes.size()) {
      const char32_t low = unit(i + 2);
      if (low >= 0xDC00 && low < 0xE000) {
        code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
        i += 2;
      }
    }
    append_utf8(out, code);
  }
  return out;
}

std::string declared_encoding(std::string_view text) {
  if (!text.starts_with("<?xml")) return "";
  const std::string_view head = text.substr(0, std::min(text.find("?>"), std::size_t{200}));
  const std::size_t at = head.find("encoding");
  if (at == std::string_view::npos) return "";
  const std::size_t quote = head.find_first_of("\"'", at);
  if (quote == std::string_view::npos) return "";
  const std::size_t end = head.find(head[quote], quote + 1);
  if (end == std::string_view::npos) return "";
  std::string out(head.substr(quote + 1, end - quote - 1));
  for (char& c : out) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return out;
}

}  // namespace

std::string_view as_utf8(std::string_view text, std::string& converted) {
  if (text.starts_with("\xEF\xBB\xBF")) return text.substr(3);
  const bool big = text.starts_with("\xFE\xFF");
  if (big || text.starts_with("\xFF\xFE")) {
    converted = from_utf16(text, big);
    return converted;
  }
  const std::string encoding = declared_encoding(text);
  if (encoding.empty() || encoding == "utf-8" || encoding == "utf8" || encoding == "us-ascii" ||
      encoding == "ascii")
    return text;
  if (is_utf8(text)) return text;
  if (encoding != "iso-8859-1" && encoding != "latin-1" && encoding != "latin1")
    throw UnknownEncoding(encoding);
  for (const char c : text) append_utf8(converted, static_cast<unsigned char>(c));
  return converted;
}

TolerantText tolerant_text(std::string_view bytes) {
  TolerantText out;
  bytes = bytes.substr(bytes.starts_with("\xEF\xBB\xBF") ? 3 : 0);
  const std::size_t nul = bytes.find('\0');
  if (nul != std::string_view::npos) bytes = bytes.substr(0, nul);
  const auto changed = [&out] { out.first_changed = std::min(out.first_changed, out.text.size()); };
  while (!bytes.empty()) {
    const auto c = static_cast<unsigned char>(bytes[0]);
    const std::size_t length = utf8_length(bytes);
    const bool control = c < 0x20 && c != '\t' && c != '\n' && c != '\r';
    if (length == 0 || control) {
      changed();
      append_utf8(out.text, control ? U' ' : char32_t{c});
    } else {
      out.text += bytes.substr(0, length);
    }
    bytes.remove_prefix(std::max<std::size_t>(length, 1));
  }
  if (nul != std::string_view::npos) changed();
  return out;
}

char32_t character_reference(std::string_view digits) {
  int base = 10;
  if (digits.starts_with('x')) {
    base = 16;
    digits.remove_prefix(1);
  }
  unsigned code = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), code, base);
  if (error != std::errc{} || end != digits.data() + digits.size() || digits.empty()) return 0;
  const bool control = code < 0x20 && code != '\t' && code != '\n' && code != '\r';
  const bool surrogate = code >= 0xD800 && code < 0xE000;
  return control || surrogate || code > 0x10FFFF || code == 0xFFFE || code == 0xFFFF ? 0 : code;
}

}  // namespace doppel
