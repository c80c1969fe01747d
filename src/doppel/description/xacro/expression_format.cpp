// Python's three ways to format: format(value, spec), "..." % values, "...".format(values). Source: The
// Python Standard Library, "Format Specification Mini-Language" and "printf-style String Formatting".
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/utf8.h"
#include "doppel/description/xacro/detail/expression_operators.h"

namespace doppel {
namespace {

constexpr int kMaxWidth = 10'000;

struct Spec {
  std::string fill = " ";
  char align = 0;  // < > ^ =
  char sign = '-';
  bool alternate = false;
  int width = 0;
  char grouping = 0;
  int precision = -1;
  char type = 0;
};

int read_number(std::string_view text, std::size_t& at) {
  int out = 0;
  for (; at < text.size() && text[at] >= '0' && text[at] <= '9'; ++at) {
    out = out * 10 + (text[at] - '0');
    if (out > kMaxWidth) throw ExpressionError(fmt::format("the format '{}' is too wide", text));
  }
  return out;
}

bool aligns(char c) {
  return c == '<' || c == '>' || c == '^' || c == '=';
}

Spec parse_spec(std::string_view text) {
  Spec out;
  std::size_t at = 0;
  const std::size_t first = text.empty() ? 0 : character_length(text);
  if (first < text.size() && aligns(text[first])) {
    out.fill = text.substr(0, first);
    out.align = text[first];
    at = first + 1;
  } else if (!text.empty() && aligns(text[0])) {
    out.align = text[0];
    at = 1;
  }
  const auto take = [&](std::string_view any) {
    return at < text.size() && any.find(text[at]) != std::string_view::npos ? text[at++] : '\0';
  };
  if (const char sign = take("+- ")) out.sign = sign;
  out.alternate = take("#") != 0;
  if (at < text.size() && text[at] == '0' && out.align == 0) {
    out.fill = "0";
    out.align = '=';
    ++at;
  }
  out.width = read_number(text, at);
  out.grouping = take(",_");
  if (take(".") != 0) {
    const std::size_t before = at;
    out.precision = read_number(text, at);
    if (at == before) throw ExpressionError(fmt::format("the format '{}' has no precision", text));
  }
  out.type = take("sdboxXncfFeEgG%");
  if (at != text.size()) throw ExpressionError(fmt::format("'{}' is not a format", text));
  return out;
}

std::string padded(const Spec& spec, const std::string& sign, const std::string& body, char natural) {
  const std::size_t length = count_characters(sign) + count_characters(body);
  const auto width = static_cast<std::size_t>(spec.width);
  if (length >= width) return sign + body;
  const auto fill = [&](std::size_t n) {
    std::string out;
    for (std::size_t i = 0; i < n; ++i) out += spec.fill;
    return out;
  };
  const std::size_t room = width - length;
  switch (spec.align == 0 ? natural : spec.align) {
    case '<':
      return sign + body + fill(room);
    case '^':
      return fill(room / 2) + sign + body + fill(room - room / 2);
    case '=':
      return sign + fill(room) + body;
    default:
      return fill(room) + sign + body;
  }
}

std::string grouped(std::string digits, char separator, std::size_t every) {
  if (separator == 0) return digits;
  const std::size_t whole = std::min(digits.find_first_not_of("0123456789abcdefABCDEF"), digits.size());
  for (std::size_t i = whole; i > every; i -= every) digits.insert(i - every, 1, separator);
  return digits;
}

std::string sign_of(bool negative, char style) {
  return negative ? "-" : style == '-' ? "" : std::string(1, style);
}

std::string integer_text(const Spec& spec, const WholeNumber& value) {
  const WholeNumber magnitude = value.negative() ? -value : value;
  std::string digits, prefix;
  switch (spec.type) {
    case 'b':
      digits = magnitude.text(2), prefix = "0b";
      break;
    case 'o':
      digits = magnitude.text(8), prefix = "0o";
      break;
    case 'x':
      digits = magnitude.text(16), prefix = "0x";
      break;
    case 'X':
      digits = magnitude.text(16), prefix = "0X";
      for (char& c : digits) c = c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c;
      break;
    default:
      digits = magnitude.text();
  }
  const bool decimal = spec.type == 0 || spec.type == 'd' || spec.type == 'n';
  return padded(spec, sign_of(value.negative(), spec.sign) + (spec.alternate ? prefix : ""),
                grouped(digits, spec.grouping, decimal ? 3 : 4), '>');
}

// The shortest digits, always with a point, as Python formats a precision without a type.
std::string general(double magnitude, int precision) {
  std::string out = fmt::format("{:.{}g}", magnitude, std::max(1, precision));
  if (out.find_first_of(".en") == std::string::npos) out += ".0";
  return out;
}

std::string real_digits(const Spec& spec, double magnitude) {
  const int precision = spec.precision < 0 ? 6 : spec.precision;
  switch (spec.type) {
    case 0:
      return spec.precision < 0 ? format_real(magnitude) : general(magnitude, spec.precision);
    case 'e':
      return fmt::format(fmt::runtime(spec.alternate ? "{:#.{}e}" : "{:.{}e}"), magnitude, precision);
    case 'E':
      return fmt::format(fmt::runtime(spec.alternate ? "{:#.{}E}" : "{:.{}E}"), magnitude, precision);
    case 'f':
      return fmt::format(fmt::runtime(spec.alternate ? "{:#.{}f}" : "{:.{}f}"), magnitude, precision);
    case 'F':
      return fmt::format("{:.{}F}", magnitude, precision);
    case 'G':
      return fmt::format(fmt::runtime(spec.alternate ? "{:#.{}G}" : "{:.{}G}"), magnitude,
                         std::max(1, precision));
    case '%':
      return fmt::format("{:.{}f}%", magnitude * 100.0, precision);
    default:
      return fmt::format(fmt::runtime(spec.alternate ? "{:#.{}g}" : "{:.{}g}"), magnitude,
                         std::max(1, precision));
  }
}

std::string real_text(const Spec& spec, double value) {
  if (spec.precision > 1000) throw ExpressionError("the format's precision is too high");
  const bool negative = std::signbit(value) && !std::isnan(value);
  return padded(spec, sign_of(negative, spec.sign),
                grouped(real_digits(spec, std::isnan(value) ? value : std::abs(value)), spec.grouping, 3),
                '>');
}

std::string string_text(const Spec& spec, const std::string& text) {
  std::string_view cut = text;
  if (spec.precision >= 0) {
    std::size_t end = 0;
    for (int i = 0; i < spec.precision && end < cut.size(); ++i) end += character_length(cut.substr(end));
    cut = cut.substr(0, end);
  }
  return padded(spec, "", std::string(cut), '<');
}

bool real_type(char type) {
  return std::string_view("fFeEgG%").find(type) != std::string_view::npos && type != 0;
}

std::string formatted(const Spec& spec, const Value& value) {
  if (value.is<double>() || (value.whole() && real_type(spec.type))) {
    if (spec.type != 0 && spec.type != 'n' && !real_type(spec.type))
      throw ExpressionError(
          fmt::format("the format '{}' does not fit the float {}", spec.type, value.brief()));
    return real_text(spec, value.real());
  }
  if (value.whole() && spec.type != 's' && !(value.is<bool>() && spec.type == 0)) {
    if (spec.precision >= 0) throw ExpressionError("the format of an int takes no precision");
    if (spec.type != 'c') return integer_text(spec, value.whole_number());
    std::string out;
    if (!value.integral() || value.integer() < 0 || value.integer() > 0x10FFFF)
      throw ExpressionError(fmt::format("{} is not a character", value.brief()));
    append_utf8(out, static_cast<char32_t>(value.integer()));
    return string_text(spec, out);
  }
  if (spec.type != 0 && spec.type != 's')
    throw ExpressionError(
        fmt::format("the format '{}' does not fit {} ({})", spec.type, value.brief(), value.type_name()));
  return string_text(spec, value.str());
}

// One conversion of "..." % values.
struct Conversion {
  std::string name;  // of %(name)s
  bool named = false, left = false, zero = false;
  Spec spec;
};

class PercentFormat {
 public:
  PercentFormat(const std::string& format, const Value& value) : format_(format), value_(value) {
    if (value.is<Value::Tuple>())
      arguments_ = value.values();
    else
      arguments_ = {value};
  }

  std::string text() {
    std::string out;
    while (at_ < format_.size()) {
      if (format_[at_] != '%') {
        out += format_[at_++];
        continue;
      }
      ++at_;
      out += conversion();
      if (out.size() > 1'000'000) throw ExpressionError("the result is too long", "xacro.too_much");
    }
    const bool mapping = value_.is<Value::Dict>();
    if (used_ < arguments_.size() && !mapping && !(value_.is<Value::List>() && used_ > 0))
      throw ExpressionError(fmt::format("not all arguments were used by the format '{}'", format_));
    return out;
  }

 private:
  char next() {
    if (at_ >= format_.size()) throw ExpressionError(fmt::format("incomplete format '{}'", format_));
    return format_[at_++];
  }
  const Value& argument() {
    if (used_ >= arguments_.size())
      throw ExpressionError(fmt::format("not enough arguments for the format '{}'", format_));
    return arguments_[used_++];
  }
  int number_or_star() {
    if (at_ < format_.size() && format_[at_] == '*') {
      ++at_;
      const Value& given = argument();
      if (!given.integral() || std::abs(given.integer()) > kMaxWidth)
        throw ExpressionError("'*' in a format needs an integer");
      return static_cast<int>(given.integer());
    }
    return read_number(format_, at_);
  }

  std::string conversion() {
    Conversion c;
    char kind = next();
    if (kind == '%') return "%";
    if (kind == '(') {
      const std::size_t end = format_.find(')', at_);
      if (end == std::string::npos) throw ExpressionError(fmt::format("incomplete format '{}'", format_));
      c.name = format_.substr(at_, end - at_);
      c.named = true;
      at_ = end + 1;
      kind = next();
    }
    for (; std::string_view("-+ #0").find(kind) != std::string_view::npos; kind = next()) {
      if (kind == '-') c.left = true;
      if (kind == '0') c.zero = true;
      if (kind == '#') c.spec.alternate = true;
      if (kind == '+' || (kind == ' ' && c.spec.sign != '+')) c.spec.sign = kind;
    }
    --at_;
    c.spec.width = number_or_star();
    if (c.spec.width < 0) {
      c.left = true;
      c.spec.width = -c.spec.width;
    }
    if (at_ < format_.size() && format_[at_] == '.') {
      ++at_;
      c.spec.precision = std::max(0, number_or_star());
    }
    return converted(c, next());
  }

  std::string converted(Conversion& c, char kind) {
    const Value given = c.named ? index_value(value_, Value(c.name)) : argument();
    const bool numeric = std::string_view("diuoxXeEfFgG").find(kind) != std::string_view::npos;
    c.spec.align = c.left ? '<' : c.zero && numeric ? '=' : '>';
    if (c.zero && numeric && !c.left) c.spec.fill = "0";
    switch (kind) {
      case 's':
        return string_text(c.spec, given.str());
      case 'r':
      case 'a':
        return string_text(c.spec, given.repr());
      case 'c':
        return formatted_character(c.spec, given);
      case 'd':
      case 'i':
      case 'u':
      case 'o':
      case 'x':
      case 'X':
        return whole(c, kind, given);
      case 'e':
      case 'E':
      case 'f':
      case 'F':
      case 'g':
      case 'G':
        if (!given.number()) refuse(kind, given);
        c.spec.type = kind;
        return real_text(c.spec, given.real());
      default:
        throw ExpressionError(fmt::format("'%{}' is not a format", kind));
    }
  }
  [[noreturn]] static void refuse(char kind, const Value& given) {
    throw ExpressionError(fmt::format("%{} needs a number, not {}", kind, given.brief()));
  }
  static std::string formatted_character(Spec spec, const Value& given) {
    if (given.is<std::string>() && count_characters(given.as<std::string>()) == 1)
      return string_text(spec, given.as<std::string>());
    if (!given.integral()) throw ExpressionError("%c needs a character");
    spec.type = 'c';
    spec.precision = -1;
    return formatted(spec, given);
  }
  static std::string whole(Conversion& c, char kind, const Value& given) {
    if (!given.number() || (given.is<double>() && kind != 'd' && kind != 'i' && kind != 'u'))
      refuse(kind, given);
    if (given.is<double>() && !std::isfinite(given.real()))
      throw ExpressionError(fmt::format("%{} of {}, which is not an integer", kind, given.brief()));
    const WholeNumber value = given.whole() ? given.whole_number() : WholeNumber(given.real());
    c.spec.type = kind == 'i' || kind == 'u' ? 'd' : kind;
    const int digits = std::exchange(c.spec.precision, -1);
    if (digits <= 0) return integer_text(c.spec, value);
    Spec inner;
    inner.type = c.spec.type;
    inner.fill = "0";
    inner.align = '=';
    inner.width = digits;
    const std::string body = integer_text(inner, value.negative() ? -value : value);
    return padded(c.spec, sign_of(value.negative(), c.spec.sign), body, '>');
  }

  const std::string& format_;
  const Value& value_;
  ValueList arguments_;
  std::size_t at_ = 0, used_ = 0;
};

class BraceFormat {
 public:
  BraceFormat(const ValueList& arguments, const KeywordArguments& keywords)
      : arguments_(arguments), keywords_(keywords) {}

  std::string text(const std::string& format, int depth) {
    if (depth > 2) throw ExpressionError("format() is nested too deeply");
    std::string out;
    for (std::size_t i = 0; i < format.size(); ++i) {
      const bool doubled = i + 1 < format.size() && format[i + 1] == format[i];
      if ((format[i] == '{' || format[i] == '}') && doubled) {
        out += format[i++];
      } else if (format[i] == '}') {
        throw ExpressionError("a single '}' in the format");
      } else if (format[i] != '{') {
        out += format[i];
      } else {
        const std::size_t end = closing(format, i);
        out += field(format.substr(i + 1, end - i - 1), depth);
        i = end;
      }
      if (out.size() > 1'000'000) throw ExpressionError("the result is too long", "xacro.too_much");
    }
    return out;
  }

 private:
  static std::size_t closing(const std::string& format, std::size_t open) {
    int braces = 0;
    for (std::size_t i = open; i < format.size(); ++i) {
      if (format[i] == '{') ++braces;
      if (format[i] == '}' && --braces == 0) return i;
    }
    throw ExpressionError("format() needs a closing brace");
  }

  std::string field(const std::string& inner, int depth) {
    const std::size_t colon = inner.find(':');
    std::string path = inner.substr(0, colon), conversion;
    const std::string spec = colon == std::string::npos ? "" : text(inner.substr(colon + 1), depth + 1);
    if (const std::size_t bang = path.find('!'); bang != std::string::npos) {
      conversion = path.substr(bang + 1);
      path.erase(bang);
    }
    const Value value = find(path);
    if (conversion == "r" || conversion == "a") return format_value(Value(value.repr()), spec);
    return format_value(conversion == "s" ? Value(value.str()) : value, spec);
  }

  // "0", "name", "pose.x", "joints[2]".
  Value find(const std::string& path) {
    std::size_t at = std::min(path.find_first_of(".["), path.size());
    const std::string head = path.substr(0, at);
    Value out = first(head);
    while (at < path.size()) {
      if (path[at] == '.') {
        const std::size_t end = std::min(path.find_first_of(".[", at + 1), path.size());
        out = get_attribute(out, path.substr(at + 1, end - at - 1));
        at = end;
      } else {
        const std::size_t end = path[at] == '[' ? path.find(']', at) : std::string::npos;
        if (end == std::string::npos) throw ExpressionError(fmt::format("'{{{}}}' is not a field", path));
        const std::string key = path.substr(at + 1, end - at - 1);
        std::int64_t index = 0;
        out = index_value(out, parse_integer(key, index) ? Value(index) : Value(key));
        at = end + 1;
      }
    }
    return out;
  }
  Value first(const std::string& name) {
    std::int64_t position = 0;
    if (name.empty()) position = next_++;
    if (name.empty() || parse_integer(name, position)) {
      if (position >= 0 && static_cast<std::size_t>(position) < arguments_.size())
        return arguments_[static_cast<std::size_t>(position)];
    } else {
      for (const auto& [key, given] : keywords_) {
        if (key == name) return given;
      }
    }
    throw ExpressionError(fmt::format("format() has no value for '{{{}}}'", name));
  }

  const ValueList& arguments_;
  const KeywordArguments& keywords_;
  std::int64_t next_ = 0;
};

}  // namespace

std::string format_value(const Value& value, std::string_view spec) {
  return spec.empty() ? value.str() : formatted(parse_spec(spec), value);
}

std::string percent_format(const std::string& format, const Value& value) {
  return PercentFormat(format, value).text();
}

std::string brace_format(const std::string& format, const ValueList& arguments,
                         const KeywordArguments& keywords) {
  return BraceFormat(arguments, keywords).text(format, 0);
}

}  // namespace doppel
