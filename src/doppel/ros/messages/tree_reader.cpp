// The rules by which a text form of a message becomes CDR; both YAML and JSON arrive here as a tree.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/base/core/utf8.h"
#include "doppel/ros/messages/detail/cdr.h"
#include "doppel/ros/messages/detail/limits.h"
#include "doppel/ros/messages/detail/text_tree.h"

namespace doppel {
namespace {

using messages_detail::TextKind;
using messages_detail::TextNode;
using messages_detail::TextTree;

struct ParseError {
  std::string why;
};

[[noreturn]] void refuse(const TextNode& node, const std::string& why) {
  throw ParseError{fmt::format("{}:{}: {}", node.place.line, node.place.column, why)};
}

// The begin of a text that may be as long as its message. It ends with a whole character, because an answer
// is UTF-8.
std::string beginning_of(std::string_view text) {
  constexpr std::size_t kShown = 100;  // bytes
  if (text.size() <= kShown) return std::string(text);
  std::size_t end = kShown;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return fmt::format("{}...", text.substr(0, end));
}

bool is_scalar(const TextNode& node) {
  return node.kind == TextKind::scalar;
}

bool is_time(const TypeDescription& type) {
  return type.name == "builtin_interfaces/msg/Time" || type.name == "builtin_interfaces/msg/Duration";
}

std::optional<bool> parse_bool(std::string_view text) {
  const std::string lower = lowered(text);
  if (lower == "true" || lower == "yes" || lower == "on") return true;
  if (lower == "false" || lower == "no" || lower == "off") return false;
  return std::nullopt;
}

std::optional<double> parse_real(std::string_view text) {
  const std::string lower = lowered(text);
  std::string_view rest = lower;
  const bool negative = rest.starts_with('-');
  if (negative || rest.starts_with('+')) rest.remove_prefix(1);
  double value = 0;
  if (rest == ".nan" || rest == "nan") return std::numeric_limits<double>::quiet_NaN();
  if (rest == ".inf" || rest == "inf") {
    value = std::numeric_limits<double>::infinity();
  } else {
    if (rest.empty() || !(std::isdigit(static_cast<unsigned char>(rest[0])) || rest[0] == '.'))
      return std::nullopt;
    const auto [end, problem] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    if (problem != std::errc() || end != rest.data() + rest.size()) return std::nullopt;
  }
  return negative ? -value : value;
}

struct Whole {
  bool negative = false;
  std::uint64_t magnitude = 0;
};

std::optional<Whole> parse_whole(std::string_view text) {
  Whole whole{.negative = text.starts_with('-')};
  if (whole.negative || text.starts_with('+')) text.remove_prefix(1);
  int base = 10;
  if (text.starts_with("0x")) base = 16;
  if (text.starts_with("0o")) base = 8;
  if (base != 10) text.remove_prefix(2);
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), whole.magnitude, base);
  if (problem != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return whole;
}

class TreeReader {
 public:
  TreeReader(const TextTree& tree, Bytes& out) : tree_(tree), out_(out) {}

  void root(const TypeDescription& type) {
    if (tree_.size() == 0 || tree_.node(0).kind == TextKind::nothing) return initial(type);
    message(type, tree_.node(0));
  }

 private:
  [[nodiscard]] std::string shown(const TextNode& node) const {
    if (node.kind == TextKind::map) return "a map";
    if (node.kind == TextKind::list) return "a list";
    if (node.kind == TextKind::nothing) return "nothing";
    return fmt::format("'{}'", beginning_of(tree_.text(node)));
  }

  void initial(const TypeDescription& type) {
    if (type.fields.empty()) out_.number(std::uint8_t{0});
    for (const FieldDescription& field : type.fields) initial(field);
  }

  void message(const TypeDescription& type, const TextNode& node) {
    if (stands_for_now(type, node)) return initial(type);
    if (is_time(type) && is_scalar(node) && nanoseconds(node)) return;
    if (node.kind != TextKind::map) refuse(node, expected_map(type, node));
    const std::vector<const TextNode*> values = by_field(type, node);
    if (type.fields.empty()) out_.number(std::uint8_t{0});
    for (std::size_t i = 0; i < type.fields.size(); ++i) {
      if (values[i] != nullptr) {
        value(type.fields[i], *values[i]);
      } else {
        initial(type.fields[i]);
      }
    }
  }

  // A whole number for a time or duration is in nanoseconds, as in ROS 1.
  bool nanoseconds(const TextNode& node) {
    std::int64_t total = 0;
    const std::string_view text = tree_.text(node);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), total);
    constexpr std::int64_t kBillion = 1'000'000'000;
    const bool fits = total >= 0 && total / kBillion <= std::numeric_limits<std::int32_t>::max();
    if (error != std::errc{} || end != text.data() + text.size() || !fits) return false;
    out_.number(static_cast<std::int32_t>(total / kBillion));
    out_.number(static_cast<std::uint32_t>(total % kBillion));
    return true;
  }

  [[nodiscard]] bool stands_for_now(const TypeDescription& type, const TextNode& node) const {
    if (!is_scalar(node)) return false;
    return (type.name == "std_msgs/msg/Header" && tree_.text(node) == "auto") ||
           (type.name == "builtin_interfaces/msg/Time" && tree_.text(node) == "now");
  }

  [[nodiscard]] std::string expected_map(const TypeDescription& type, const TextNode& node) const {
    std::string example = "{}";
    if (!type.fields.empty()) example = fmt::format("{{{}: ...}}", type.fields.front().name);
    return fmt::format("{} where a {} is expected; write it as {}", shown(node), type.name, example);
  }

  // Maps each field to its node, or to nullptr if the text omits it.
  [[nodiscard]] std::vector<const TextNode*> by_field(const TypeDescription& type,
                                                      const TextNode& node) const {
    std::vector<const TextNode*> values(type.fields.size(), nullptr);
    for (std::size_t i = 0, at = tree_.first_child(node); i < node.size; i += 2) {
      const TextNode& name = tree_.node(at);
      at = tree_.after(at);
      if (!is_scalar(name)) refuse(name, fmt::format("expected a field name, not {}", shown(name)));
      std::string_view key = tree_.text(name);
      if (is_time(type) && (key == "secs" || key == "nsecs"))
        key = key == "secs" ? "sec" : "nanosec";  // ROS 1
      const auto field = std::ranges::find(type.fields, key, &FieldDescription::name);
      if (field == type.fields.end()) refuse_field(type, key, name);
      const auto index = static_cast<std::size_t>(field - type.fields.begin());
      if (values[index] != nullptr) refuse(name, fmt::format("field '{}' is given twice", key));
      values[index] = &tree_.node(at);
      at = tree_.after(at);
    }
    return values;
  }

  [[noreturn]] static void refuse_field(const TypeDescription& type, std::string_view key,
                                        const TextNode& name) {
    std::vector<std::string> names;
    for (const FieldDescription& field : type.fields) names.push_back(field.name);
    refuse(name,
           fmt::format("{} has no field '{}'{}", type.name, beginning_of(key), did_you_mean(key, names)));
  }

  void initial(const FieldDescription& field) {
    if (field.shape == FieldShape::sequence) return out_.number(std::uint32_t{0});
    for (std::size_t i = 0; i < field.count; ++i) {
      if (field.kind == FieldKind::message) {
        initial(*field.type);
      } else if (field.kind == FieldKind::text) {
        out_.text("");
      } else if (field.kind == FieldKind::wide_text) {
        out_.wide_text(u"");
      } else {
        number(field.kind, field.initial);
      }
    }
  }

  void value(const FieldDescription& field, const TextNode& node) {
    if (field.shape == FieldShape::single) return element(field, node);
    if (node.kind != TextKind::list) {
      refuse(node, fmt::format("{}, but '{}' is a list; write it as [...]", shown(node), field.name));
    }
    if (field.shape == FieldShape::sequence) {
      if (field.bound > 0 && node.size > field.bound) {
        refuse(node, fmt::format("'{}' has at most {} elements, but {} are given", field.name, field.bound,
                                 node.size));
      }
      out_.number(static_cast<std::uint32_t>(node.size));
    } else if (node.size != field.count) {
      refuse(node,
             fmt::format("'{}' needs {} elements, but {} are given", field.name, field.count, node.size));
    }
    for (std::size_t i = 0, at = tree_.first_child(node); i < node.size; ++i, at = tree_.after(at))
      element(field, tree_.node(at));
  }

  void element(const FieldDescription& field, const TextNode& node) {
    if (out_.size() > messages_detail::kMaxMessageSize)
      refuse(node, "the message would be larger than 64 MiB");
    switch (field.kind) {
      case FieldKind::message:
        return message(*field.type, node);
      case FieldKind::text:
      case FieldKind::wide_text:
        return text(field, node);
      case FieldKind::boolean:
        return boolean(field, node);
      case FieldKind::float32:
      case FieldKind::float64:
        return real(field, node);
      default:
        return whole(field, node);
    }
  }

  void text(const FieldDescription& field, const TextNode& node) {
    if (!is_scalar(node)) {
      refuse(node, fmt::format("{}, but '{}' is a string; an empty one is ''", shown(node), field.name));
    }
    const std::u16string wide = field.kind == FieldKind::wide_text ? to_utf16(tree_.text(node)) : u"";
    const std::size_t size = field.kind == FieldKind::wide_text ? wide.size() : node.size;
    if (field.text_bound > 0 && size > field.text_bound) {
      refuse(node, fmt::format("'{}' has at most {} characters, but {} are given", field.name,
                               field.text_bound, size));
    }
    if (field.kind == FieldKind::wide_text) return out_.wide_text(wide);
    out_.text(tree_.text(node));
  }

  void boolean(const FieldDescription& field, const TextNode& node) {
    std::optional<bool> value;
    if (is_scalar(node) && !node.quoted) value = parse_bool(tree_.text(node));
    if (!value) {
      refuse(node, fmt::format("{}, but '{}' is true or false", shown(node), field.name));
    }
    out_.number(static_cast<std::uint8_t>(*value));
  }

  void real(const FieldDescription& field, const TextNode& node) {
    std::optional<double> value;
    if (is_scalar(node)) value = parse_real(tree_.text(node));
    if (!value && is_scalar(node)) {
      if (const auto whole = parse_whole(tree_.text(node))) {  // 0x10
        value = (whole->negative ? -1.0 : 1.0) * static_cast<double>(whole->magnitude);
      }
    }
    if (!value) refuse(node, fmt::format("{}, but '{}' is a number", shown(node), field.name));
    const bool overflows = std::isfinite(*value) && std::abs(*value) > std::numeric_limits<float>::max();
    if (field.kind == FieldKind::float32 && overflows) {
      refuse(node, fmt::format("{} does not fit into the float32 '{}'", shown(node), field.name));
    }
    number(field.kind, *value);
  }

  void whole(const FieldDescription& field, const TextNode& node) {
    std::optional<Whole> value;
    if (is_scalar(node)) value = parse_whole(tree_.text(node));
    if (!value) refuse(node, fmt::format("{}, but '{}' is an integer", shown(node), field.name));
    bool fits = false;
    switch (field.kind) {
      case FieldKind::int8:
        fits = write<std::int8_t>(*value);
        break;
      case FieldKind::byte:
      case FieldKind::character:
      case FieldKind::uint8:
        fits = write<std::uint8_t>(*value);
        break;
      case FieldKind::int16:
        fits = write<std::int16_t>(*value);
        break;
      case FieldKind::wide_character:
      case FieldKind::uint16:
        fits = write<std::uint16_t>(*value);
        break;
      case FieldKind::int32:
        fits = write<std::int32_t>(*value);
        break;
      case FieldKind::uint32:
        fits = write<std::uint32_t>(*value);
        break;
      case FieldKind::int64:
        fits = write<std::int64_t>(*value);
        break;
      default:
        fits = write<std::uint64_t>(*value);
        break;
    }
    if (!fits) {
      refuse(node,
             fmt::format("{} does not fit into the {} '{}'", shown(node), to_string(field.kind), field.name));
    }
  }

  template <class T>
  bool write(const Whole& value) {
    const auto largest = static_cast<std::uint64_t>(std::numeric_limits<T>::max());
    const bool below_zero = value.negative && value.magnitude > 0;
    if (below_zero && (std::unsigned_integral<T> || value.magnitude > largest + 1)) return false;
    if (!below_zero && value.magnitude > largest) return false;
    out_.number(static_cast<T>(below_zero ? ~value.magnitude + 1 : value.magnitude));
    return true;
  }

  void number(FieldKind kind, double value) {
    switch (kind) {
      case FieldKind::boolean:
        return out_.number(static_cast<std::uint8_t>(value != 0));
      case FieldKind::int8:
        return out_.number(static_cast<std::int8_t>(value));
      case FieldKind::byte:
      case FieldKind::character:
      case FieldKind::uint8:
        return out_.number(static_cast<std::uint8_t>(value));
      case FieldKind::int16:
        return out_.number(static_cast<std::int16_t>(value));
      case FieldKind::wide_character:
      case FieldKind::uint16:
        return out_.number(static_cast<std::uint16_t>(value));
      case FieldKind::int32:
        return out_.number(static_cast<std::int32_t>(value));
      case FieldKind::uint32:
        return out_.number(static_cast<std::uint32_t>(value));
      case FieldKind::int64:
        return out_.number(static_cast<std::int64_t>(value));
      case FieldKind::uint64:
        return out_.number(static_cast<std::uint64_t>(value));
      case FieldKind::float32:
        return out_.number(static_cast<float>(value));
      default:
        return out_.number(value);
    }
  }

  const TextTree& tree_;
  CdrAppender out_;
};

}  // namespace

namespace messages_detail {

Status tree_to_cdr(const TypeDescription& type, const TextTree& tree, Bytes& out) {
  try {
    TreeReader(tree, out).root(type);
    return {};
  } catch (const ParseError& error) {
    return Status::refused(error.why);
  }
}

}  // namespace messages_detail
}  // namespace doppel
