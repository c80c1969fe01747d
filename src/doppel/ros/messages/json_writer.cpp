// Messages as compact JSON (RFC 8259).

#include <fmt/format.h>

#include <cmath>

#include "doppel/base/core/utf8.h"
#include "doppel/ros/messages/type_description.h"

namespace doppel {
namespace {

class JsonWriter : public ValueSink {
 public:
  explicit JsonWriter(std::string& out) : out_(out) {}

  void begin_message(const TypeDescription&) override { open('{'); }
  void field(const FieldDescription& field) override {
    separate();
    out_ += '"' + field.name + "\":";
    first_ = true;
  }
  void end_message() override { close('}'); }
  void begin_list(std::size_t) override { open('['); }
  void end_list() override { close(']'); }
  void boolean(bool value) override { scalar(value ? "true" : "false"); }
  void integer(std::int64_t value) override { scalar(std::to_string(value)); }
  void natural(std::uint64_t value) override { scalar(std::to_string(value)); }
  void real(double value) override { scalar(std::isfinite(value) ? shortest_decimal(value) : "null"); }
  void text(std::string_view value) override { scalar(quoted(value)); }

 private:
  void separate() {
    if (!first_) out_ += ',';
    first_ = false;
  }
  void open(char bracket) {
    separate();
    out_ += bracket;
    first_ = true;
  }
  void close(char bracket) {
    out_ += bracket;
    first_ = false;
  }
  void scalar(std::string_view text) {
    separate();
    out_ += text;
  }

  static std::string quoted(std::string_view text) {
    std::string out = "\"";
    for (std::size_t at = 0; at < text.size();) {
      const Utf8Char c = next_utf8(text, at);
      if (!c.valid) {
        out += "\xEF\xBF\xBD";  // U+FFFD
      } else if (c.code == U'"' || c.code == U'\\') {
        out += {'\\', static_cast<char>(c.code)};
      } else if (c.code == U'\n') {
        out += "\\n";
      } else if (c.code < 0x20) {
        out += fmt::format("\\u{:04x}", static_cast<unsigned>(c.code));
      } else {
        out += text.substr(at, c.size);
      }
      at += c.size;
    }
    return out + '"';
  }

  std::string& out_;
  bool first_ = true;
};

}  // namespace

Status cdr_to_json(const TypeDescription& type, std::span<const std::byte> cdr, std::string& out) {
  out.clear();
  JsonWriter writer(out);
  return walk_cdr(type, cdr, writer);
}

}  // namespace doppel
