#include "doppel/ros/messages/type_description.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "doppel/base/core/utf8.h"
#include "doppel/ros/messages/detail/cdr.h"

namespace doppel {
namespace {

constexpr std::string_view kKindNames[] = {"bool",  "byte",   "int8",   "uint8",   "int16",   "uint16",
                                           "int32", "uint32", "int64",  "uint64",  "float32", "float64",
                                           "char",  "wchar",  "string", "wstring", ""};
constexpr std::size_t kKindSizes[] = {1, 1, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8, 1, 2, 4, 4, 0};

class Walker {
 public:
  Walker(CdrReader& reader, ValueSink& sink) : reader_(reader), sink_(sink) {}

  bool message(const TypeDescription& type) {
    sink_.begin_message(type);
    std::uint8_t unused = 0;
    if (type.fields.empty() && !reader_.number(unused)) return false;
    for (const FieldDescription& field : type.fields) {
      sink_.field(field);
      if (!value(field)) {
        reader_.within(field.name);
        return false;
      }
    }
    sink_.end_message();
    return true;
  }

 private:
  bool value(const FieldDescription& field) {
    if (field.shape == FieldShape::single) return element(field);
    auto size = static_cast<std::uint32_t>(field.count);
    if (field.shape == FieldShape::sequence && !reader_.length(size, field.least_element_size(), field.bound))
      return false;
    sink_.begin_list(size);
    for (std::uint32_t i = 0; i < size; ++i) {
      if (!element(field)) return false;
    }
    sink_.end_list();
    return true;
  }

  template <class T>
  bool number() {
    T value{};
    if (!reader_.number(value)) return false;
    if constexpr (std::floating_point<T>) {
      sink_.real(static_cast<double>(value));
    } else if constexpr (std::signed_integral<T>) {
      sink_.integer(value);
    } else {
      sink_.natural(value);
    }
    return true;
  }

  bool element(const FieldDescription& field) {
    switch (field.kind) {
      case FieldKind::boolean: {
        bool value = false;
        if (!reader_.boolean(value)) return false;
        sink_.boolean(value);
        return true;
      }
      case FieldKind::int8:
        return number<std::int8_t>();
      case FieldKind::byte:
      case FieldKind::character:
      case FieldKind::uint8:
        return number<std::uint8_t>();
      case FieldKind::int16:
        return number<std::int16_t>();
      case FieldKind::wide_character:
      case FieldKind::uint16:
        return number<std::uint16_t>();
      case FieldKind::int32:
        return number<std::int32_t>();
      case FieldKind::uint32:
        return number<std::uint32_t>();
      case FieldKind::int64:
        return number<std::int64_t>();
      case FieldKind::uint64:
        return number<std::uint64_t>();
      case FieldKind::float32:
        return number<float>();
      case FieldKind::float64:
        return number<double>();
      case FieldKind::text: {
        std::string_view value;
        if (!reader_.text(value)) return false;
        sink_.text(value);
        return true;
      }
      case FieldKind::wide_text: {
        std::u16string value;
        if (!reader_.wide_text(value)) return false;
        sink_.text(to_utf8(value));
        return true;
      }
      case FieldKind::message:
        return message(*field.type);
    }
    return false;
  }

  CdrReader& reader_;
  ValueSink& sink_;
};

// ".msg" files name a type without the "msg" in the middle.
std::string short_name(std::string_view name) {
  const auto first = name.find('/'), last = name.rfind('/');
  return fmt::format("{}{}", name.substr(0, first), name.substr(last));
}

void collect(const TypeDescription& type, std::vector<const TypeDescription*>& types) {
  for (const FieldDescription& field : type.fields) {
    if (field.type == nullptr || std::ranges::find(types, field.type) != types.end()) continue;
    types.push_back(field.type);
    collect(*field.type, types);
  }
}

}  // namespace

std::string_view to_string(FieldKind kind) {
  return kKindNames[static_cast<std::size_t>(kind)];
}
std::string to_string(const ConstantDescription& constant) {
  const bool is_text = constant.kind == FieldKind::text;
  const std::string value = is_text ? fmt::format("\"{}\"", constant.text) : std::to_string(constant.value);
  return fmt::format("{} {}={}", to_string(constant.kind), constant.name, value);
}
std::string to_string(const FieldDescription& field) {
  std::string text =
      field.type != nullptr ? short_name(field.type->name) : std::string(to_string(field.kind));
  if (field.text_bound > 0) text += fmt::format("<={}", field.text_bound);
  if (field.shape == FieldShape::array) text += fmt::format("[{}]", field.count);
  if (field.shape == FieldShape::sequence && field.bound > 0) text += fmt::format("[<={}]", field.bound);
  if (field.shape == FieldShape::sequence && field.bound == 0) text += "[]";
  return text;
}
std::size_t least_cdr_size(FieldKind kind) {
  return kKindSizes[static_cast<std::size_t>(kind)];
}

std::size_t FieldDescription::least_element_size() const {
  return type != nullptr ? type->least_cdr_size : doppel::least_cdr_size(kind);
}

void TypeDescription::add(FieldDescription field) {
  const std::size_t least =
      field.shape == FieldShape::sequence ? 4 : field.count * field.least_element_size();
  least_cdr_size = fields.empty() ? least : least_cdr_size + least;
  fields.push_back(std::move(field));
}

Status walk_cdr(const TypeDescription& type, std::span<const std::byte> cdr, ValueSink& sink) {
  CdrReader reader(cdr);
  if (reader.ok() && Walker(reader, sink).message(type)) reader.finish();
  return reader.status(type.name);
}

std::string definition_text(const TypeDescription& type) {
  std::string text;
  for (const ConstantDescription& constant : type.constants) text += to_string(constant) + '\n';
  for (const FieldDescription& field : type.fields)
    text += fmt::format("{} {}\n", to_string(field), field.name);
  return text;
}

std::string schema_text(const TypeDescription& type) {
  std::vector<const TypeDescription*> types;
  collect(type, types);
  std::string text = definition_text(type);
  for (const TypeDescription* dependency : types) {
    text += std::string(80, '=') + "\nMSG: " + short_name(dependency->name) + '\n';
    text += definition_text(*dependency);
  }
  return text;
}

std::string shortest_decimal(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value < 0 ? "-inf" : "inf";
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::scientific).ptr;
  const std::string_view scientific(buffer, static_cast<std::size_t>(end - buffer));
  const std::size_t e = scientific.find('e');
  int exponent = 0;
  const char* digits_of_exponent = buffer + e + (buffer[e + 1] == '+' ? 2 : 1);
  std::from_chars(digits_of_exponent, end, exponent);
  if (exponent < -4 || exponent >= 16) return std::string(scientific);

  const std::string sign(scientific.starts_with('-') ? "-" : "");
  std::string digits;
  for (const char c : scientific.substr(sign.size(), e - sign.size())) {
    if (c != '.') digits += c;
  }
  if (exponent < 0) return sign + "0." + std::string(static_cast<std::size_t>(-exponent - 1), '0') + digits;
  const auto whole = static_cast<std::size_t>(exponent) + 1;
  if (digits.size() <= whole) return sign + digits + std::string(whole - digits.size(), '0') + ".0";
  return sign + digits.substr(0, whole) + "." + digits.substr(whole);
}

}  // namespace doppel
