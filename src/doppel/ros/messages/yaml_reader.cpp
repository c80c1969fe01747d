// From YAML as in `ros2 topic pub` to CDR.

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

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
#include "doppel/ros/messages/type_description.h"

namespace doppel {
namespace {

struct ParseError {
  std::string why;
};

[[noreturn]] void refuse(const YAML::Mark& mark, const std::string& why) {
  throw ParseError{fmt::format("{}:{}: {}", mark.line + 1, mark.column + 1, why)};
}

std::string shown(const YAML::Node& node) {
  if (node.IsMap()) return "a map";
  if (node.IsSequence()) return "a list";
  if (node.IsNull()) return "nothing";
  return fmt::format("'{}'", node.Scalar());
}

bool is_quoted(const YAML::Node& node) {
  return node.Tag() == "!";
}

bool is_time(const TypeDescription& type) {
  return type.name == "builtin_interfaces/msg/Time" || type.name == "builtin_interfaces/msg/Duration";
}

std::optional<bool> parse_bool(const YAML::Node& node) {
  if (!node.IsScalar() || is_quoted(node)) return std::nullopt;
  const std::string lower = lowered(node.Scalar());
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

class YamlReader {
 public:
  explicit YamlReader(Bytes& out) : out_(out) {}

  void initial(const TypeDescription& type) {
    if (type.fields.empty()) out_.number(std::uint8_t{0});
    for (const FieldDescription& field : type.fields) initial(field);
  }

  void message(const TypeDescription& type, const YAML::Node& node) {
    if (stands_for_now(type, node)) return initial(type);
    if (is_time(type) && node.IsScalar() && nanoseconds(node)) return;
    if (!node.IsMap()) refuse(node.Mark(), expected_map(type, node));
    const std::vector<YAML::Node> values = by_field(type, node);
    if (type.fields.empty()) out_.number(std::uint8_t{0});
    for (std::size_t i = 0; i < type.fields.size(); ++i) {
      if (values[i].IsDefined()) {
        value(type.fields[i], values[i]);
      } else {
        initial(type.fields[i]);
      }
    }
  }

 private:
  // As in ROS 1, a whole number for a time or duration is in nanoseconds.
  bool nanoseconds(const YAML::Node& node) {
    std::int64_t total = 0;
    const std::string& text = node.Scalar();
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), total);
    constexpr std::int64_t kBillion = 1'000'000'000;
    const bool fits = total >= 0 && total / kBillion <= std::numeric_limits<std::int32_t>::max();
    if (error != std::errc{} || end != text.data() + text.size() || !fits) return false;
    out_.number(static_cast<std::int32_t>(total / kBillion));
    out_.number(static_cast<std::uint32_t>(total % kBillion));
    return true;
  }

  static bool stands_for_now(const TypeDescription& type, const YAML::Node& node) {
    if (!node.IsScalar()) return false;
    return (type.name == "std_msgs/msg/Header" && node.Scalar() == "auto") ||
           (type.name == "builtin_interfaces/msg/Time" && node.Scalar() == "now");
  }

  static std::string expected_map(const TypeDescription& type, const YAML::Node& node) {
    std::string example = "{}";
    if (!type.fields.empty()) example = fmt::format("{{{}: ...}}", type.fields.front().name);
    return fmt::format("{} where a {} is expected; write it as {}", shown(node), type.name, example);
  }

  // The node of each field, undefined where it is left out.
  static std::vector<YAML::Node> by_field(const TypeDescription& type, const YAML::Node& node) {
    std::vector<YAML::Node> values(type.fields.size(), YAML::Node(YAML::NodeType::Undefined));
    for (const auto& entry : node) {
      const YAML::Mark mark = entry.first.Mark();
      if (!entry.first.IsScalar())
        refuse(mark, fmt::format("expected a field name, not {}", shown(entry.first)));
      std::string key = entry.first.Scalar();
      if (is_time(type) && (key == "secs" || key == "nsecs"))
        key = key == "secs" ? "sec" : "nanosec";  // ROS 1
      const auto field = std::ranges::find(type.fields, key, &FieldDescription::name);
      if (field == type.fields.end()) refuse_field(type, key, mark);
      const auto index = static_cast<std::size_t>(field - type.fields.begin());
      if (values[index].IsDefined()) refuse(mark, fmt::format("field '{}' is given twice", key));
      values[index].reset(entry.second);
    }
    return values;
  }

  [[noreturn]] static void refuse_field(const TypeDescription& type, const std::string& key,
                                        const YAML::Mark& mark) {
    std::vector<std::string> names;
    for (const FieldDescription& field : type.fields) names.push_back(field.name);
    refuse(mark, fmt::format("{} has no field '{}'{}", type.name, key, did_you_mean(key, names)));
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

  void value(const FieldDescription& field, const YAML::Node& node) {
    if (field.shape == FieldShape::single) return element(field, node);
    if (!node.IsSequence()) {
      refuse(node.Mark(), fmt::format("{}, but '{}' is a list; write it as [...]", shown(node), field.name));
    }
    if (field.shape == FieldShape::sequence) {
      if (field.bound > 0 && node.size() > field.bound) {
        refuse(node.Mark(), fmt::format("'{}' has at most {} elements, but {} are given", field.name,
                                        field.bound, node.size()));
      }
      out_.number(static_cast<std::uint32_t>(node.size()));
    } else if (node.size() != field.count) {
      refuse(node.Mark(),
             fmt::format("'{}' needs {} elements, but {} are given", field.name, field.count, node.size()));
    }
    for (const auto& item : node) element(field, item);
  }

  void element(const FieldDescription& field, const YAML::Node& node) {
    if (out_.size() > messages_detail::kMaxMessageSize)
      refuse(node.Mark(), "the message would be larger than 64 MiB");
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

  void text(const FieldDescription& field, const YAML::Node& node) {
    if (!node.IsScalar()) {
      refuse(node.Mark(),
             fmt::format("{}, but '{}' is a string; an empty one is ''", shown(node), field.name));
    }
    const std::u16string wide = field.kind == FieldKind::wide_text ? to_utf16(node.Scalar()) : u"";
    const std::size_t size = field.kind == FieldKind::wide_text ? wide.size() : node.Scalar().size();
    if (field.text_bound > 0 && size > field.text_bound) {
      refuse(node.Mark(), fmt::format("'{}' has at most {} characters, but {} are given", field.name,
                                      field.text_bound, size));
    }
    if (field.kind == FieldKind::wide_text) return out_.wide_text(wide);
    out_.text(node.Scalar());
  }

  void boolean(const FieldDescription& field, const YAML::Node& node) {
    const auto value = parse_bool(node);
    if (!value) {
      refuse(node.Mark(), fmt::format("{}, but '{}' is true or false", shown(node), field.name));
    }
    out_.number(static_cast<std::uint8_t>(*value));
  }

  void real(const FieldDescription& field, const YAML::Node& node) {
    std::optional<double> value;
    if (node.IsScalar()) value = parse_real(node.Scalar());
    if (!value && node.IsScalar()) {
      if (const auto whole = parse_whole(node.Scalar())) {  // 0x10
        value = (whole->negative ? -1.0 : 1.0) * static_cast<double>(whole->magnitude);
      }
    }
    if (!value) refuse(node.Mark(), fmt::format("{}, but '{}' is a number", shown(node), field.name));
    const bool overflows = std::isfinite(*value) && std::abs(*value) > std::numeric_limits<float>::max();
    if (field.kind == FieldKind::float32 && overflows) {
      refuse(node.Mark(), fmt::format("{} does not fit into the float32 '{}'", shown(node), field.name));
    }
    number(field.kind, *value);
  }

  void whole(const FieldDescription& field, const YAML::Node& node) {
    std::optional<Whole> value;
    if (node.IsScalar()) value = parse_whole(node.Scalar());
    if (!value) refuse(node.Mark(), fmt::format("{}, but '{}' is an integer", shown(node), field.name));
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
      refuse(node.Mark(),
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

  CdrAppender out_;
};

// The line on which a second document begins; 0: there is none. YAML::LoadAll does not terminate for
// some invalid texts.
int second_document(std::string_view yaml) {
  bool content = false;
  int line = 0;
  while (!yaml.empty()) {
    const std::string_view text = yaml.substr(0, yaml.find('\n'));
    yaml.remove_prefix(std::min(text.size() + 1, yaml.size()));
    ++line;
    const bool separates = text.starts_with("---") && (text.size() == 3 || text[3] == ' ' || text[3] == '\r');
    if (separates && content) return line;
    const std::size_t first = text.find_first_not_of(" \t\r");
    content =
        content || separates || (first != std::string_view::npos && text[first] != '#' && text[first] != '%');
  }
  return 0;
}

}  // namespace

Status yaml_to_cdr(const TypeDescription& type, std::string_view yaml, Bytes& out) {
  try {
    if (const int line = second_document(yaml); line > 0) {
      YAML::Mark mark;
      mark.line = line - 1;
      mark.column = 0;
      refuse(mark, "expected one message, not several YAML documents");
    }
    const YAML::Node document = YAML::Load(std::string(yaml));
    YamlReader reader(out);
    if (document.IsNull()) {
      reader.initial(type);
    } else {
      reader.message(type, document);
    }
    return {};
  } catch (const ParseError& error) {
    return Status::refused(error.why);
  } catch (const YAML::Exception& e) {
    return Status::refused(fmt::format("{}:{}: not YAML: {}", e.mark.line + 1, e.mark.column + 1, e.msg));
  }
}

}  // namespace doppel
