// Texts as values: xacro's literals and conditions.
#include "doppel/description/xacro/detail/characters.h"
#include "doppel/description/xacro/detail/xacro.h"

namespace doppel::xacro {
namespace {

std::optional<bool> truth_word(std::string_view text) {
  if (text == "true" || text == "True") return true;
  if (text == "false" || text == "False") return false;
  return std::nullopt;
}

// Numbers that are not plain: with blanks around, an exponent, many digits, inf. With an underscore it is
// a text here, although Python's int() accepts it.
std::optional<Value> unusual_number(std::string_view text) {
  if (text.find('_') != std::string_view::npos) return std::nullopt;
  std::string_view body = trimmed(text);
  if (body.starts_with('-') || body.starts_with('+')) body.remove_prefix(1);
  if (body.empty()) return std::nullopt;
  const auto foreign = [](char c) { return static_cast<unsigned char>(c) >= 0x80; };
  if (is_digit(body[0]) || body[0] == '.' || foreign(body[0])) {
    for (const char c : body) {
      if (!is_digit(c) && !foreign(c) && c != '.' && c != '-' && c != '+' && (c | 0x20) != 'e')
        return std::nullopt;
    }
  } else if (body.size() < 3 || body.size() > 8) {
    return std::nullopt;
  }
  if (auto whole = parse_whole(text)) return whole;
  // A whole number that is too long even for that stays as it is written.
  const std::size_t digits = text[0] == '-' || text[0] == '+' ? 1 : 0;
  if (text.size() > digits + 18 && text.find_first_not_of("0123456789", digits) == std::string_view::npos)
    return std::nullopt;
  double real = 0;
  if (parse_real(text, real)) return Value(real);
  return std::nullopt;
}

// A number or truth value; nothing: the text stays a text.
std::optional<Value> read(std::string_view text) {
  if (text.empty()) return std::nullopt;
  const char first = text[0] >= 'A' && text[0] <= 'Z' ? static_cast<char>(text[0] | 0x20) : text[0];
  if (first == 't' || first == 'f') {
    if (const auto truth = truth_word(text)) return Value(*truth);
    return std::nullopt;
  }
  if (first >= '+' && first <= '9') {
    const PlainNumber plain = parse_plain(text);
    if (plain.kind == PlainNumber::Kind::whole) return Value(plain.whole);
    if (plain.kind == PlainNumber::Kind::real) return Value(plain.real);
    return unusual_number(text);
  }
  const bool foreign = static_cast<unsigned char>(first) >= 0x80;
  return first == 'i' || first == 'n' || is_blank(first) || foreign ? unusual_number(text) : std::nullopt;
}

}  // namespace

Value literal(std::string_view text) {
  if (text.size() >= 2 && text.front() == '\'' && text.back() == '\'')
    return Value(text.substr(1, text.size() - 2));
  if (auto value = read(text)) return *std::move(value);
  return Value(text);
}

Value interpreted(Value value) {
  const std::string* const text = std::get_if<std::string>(&value.data);
  if (text == nullptr) return value;
  if (text->size() >= 2 && text->front() == '\'' && text->back() == '\'') return literal(*text);
  if (auto read_value = read(*text)) return *std::move(read_value);
  return value;
}

std::optional<bool> truth_of(const Value& value) {
  if (!value.is<std::string>()) return value.truth();
  const std::string& text = value.as<std::string>();
  if (const auto truth = truth_word(text)) return truth;
  if (const auto whole = parse_whole(text)) return whole->truth();
  return std::nullopt;
}

}  // namespace doppel::xacro
