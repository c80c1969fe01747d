// Rewrites CDR by a description: checked values, with little-endian byte order and no padding.

#include "doppel/ros/messages/detail/cdr_rewriter.h"

#include "doppel/base/core/utf8.h"

namespace doppel {
namespace {

class CdrRewriter : public ValueSink {
 public:
  explicit CdrRewriter(CdrAppender& out) : out_(out) {}

  void begin_message(const TypeDescription& type) override {
    if (type.fields.empty()) out_.number(std::uint8_t{0});
  }
  void field(const FieldDescription& field) override { field_ = &field; }
  void end_message() override {}
  void begin_list(std::size_t size) override {
    if (field_->shape == FieldShape::sequence) out_.number(static_cast<std::uint32_t>(size));
  }
  void end_list() override {}
  void boolean(bool value) override { out_.number(static_cast<std::uint8_t>(value)); }
  void integer(std::int64_t value) override { whole(static_cast<std::uint64_t>(value)); }
  void natural(std::uint64_t value) override { whole(value); }
  void real(double value) override {
    if (field_->kind == FieldKind::float64) return out_.number(value);
    out_.number(static_cast<float>(value));
  }
  void text(std::string_view value) override {
    if (field_->kind == FieldKind::text) return out_.text(value);
    out_.wide_text(to_utf16(value));
  }

 private:
  void whole(std::uint64_t value) {
    switch (least_cdr_size(field_->kind)) {
      case 1:
        return out_.number(static_cast<std::uint8_t>(value));
      case 2:
        return out_.number(static_cast<std::uint16_t>(value));
      case 4:
        return out_.number(static_cast<std::uint32_t>(value));
      default:
        return out_.number(value);
    }
  }

  CdrAppender& out_;
  const FieldDescription* field_ = nullptr;  // whose value comes next; no list holds lists
};

}  // namespace

Status append_cdr(const TypeDescription& type, std::span<const std::byte> cdr, CdrAppender& out) {
  CdrRewriter rewriter(out);
  return walk_cdr(type, cdr, rewriter);
}

Status recode_cdr(const TypeDescription& type, std::span<const std::byte> cdr, Bytes& out) {
  CdrAppender appender(out);
  return append_cdr(type, cdr, appender);
}

}  // namespace doppel
