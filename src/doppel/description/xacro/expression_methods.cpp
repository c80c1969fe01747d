// Attributes and methods of strings, lists, dicts and sets, and the members of modules and namespaces.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "doppel/base/core/names.h"
#include "doppel/description/xacro/detail/characters.h"
#include "doppel/description/xacro/detail/expression_functions.h"
#include "doppel/description/xacro/detail/expression_operators.h"

namespace doppel {
namespace {

struct NamedMethod {
  std::string_view name;
  Method method;
};
using Methods = std::span<const NamedMethod>;

const std::string& text_of(const Value& v) {
  return v.as<std::string>();
}
Value value_of_count(std::size_t n) {
  return Value(static_cast<std::int64_t>(n));
}

Value split(const Value& subject, const Arguments& a) {
  const std::string& text = text_of(subject);
  std::int64_t most = a.size() > 1 ? integer_argument(a, 1, "split") : -1;
  ValueList out;
  if (a.empty() || a[0].is<Value::None>()) {
    for (std::size_t i = 0; (i = text.find_first_not_of(kBlanks, i)) != std::string::npos;) {
      const std::size_t end = most == 0 ? text.find_last_not_of(kBlanks) + 1
                                        : std::min(text.find_first_of(kBlanks, i), text.size());
      out.emplace_back(text.substr(i, end - i));
      if (most-- == 0) break;
      i = end;
    }
    return Value::list(std::move(out));
  }
  const std::string& separator = text_argument(a, 0, "split");
  if (separator.empty()) throw ExpressionError("split() with an empty separator");
  std::size_t begin = 0;
  for (std::size_t end; most-- != 0 && (end = text.find(separator, begin)) != std::string::npos;
       begin = end + separator.size()) {
    out.emplace_back(text.substr(begin, end - begin));
  }
  out.emplace_back(text.substr(begin));
  return Value::list(std::move(out));
}

Value split_from_right(const Value& subject, const Arguments& a) {
  const std::string& text = text_of(subject);
  if (a.size() < 2) return split(subject, a);
  const std::string& separator = text_argument(a, 0, "rsplit");
  if (separator.empty()) throw ExpressionError("rsplit() with an empty separator");
  std::int64_t most = integer_argument(a, 1, "rsplit");
  ValueList out;
  std::string rest = text;
  for (std::size_t at; most-- != 0 && (at = rest.rfind(separator)) != std::string::npos;) {
    out.emplace_back(rest.substr(at + separator.size()));
    rest.erase(at);
  }
  out.emplace_back(rest);
  std::reverse(out.begin(), out.end());
  return Value::list(std::move(out));
}

Value split_lines(const Value& subject, const Arguments&) {
  ValueList out;
  const std::string& text = text_of(subject);
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t end = std::min(text.find('\n', i), text.size());
    out.emplace_back(text.substr(i, end - i));
    i = end + 1;
  }
  return Value::list(std::move(out));
}

Value partition(const Value& subject, const Arguments& a, bool right) {
  const std::string &text = text_of(subject), &by = text_argument(a, 0, "partition");
  if (by.empty()) throw ExpressionError("partition() with an empty separator");
  const std::size_t at = right ? text.rfind(by) : text.find(by);
  if (at == std::string::npos)
    return right ? Value::tuple({Value(""), Value(""), subject})
                 : Value::tuple({subject, Value(""), Value("")});
  return Value::tuple({Value(text.substr(0, at)), Value(by), Value(text.substr(at + by.size()))});
}

Value join(const Value& separator, const Arguments& a) {
  std::string out;
  bool first = true;
  for (const Value& item : items_argument(a, 0, "join")) {
    if (!item.is<std::string>())
      throw ExpressionError(fmt::format("join() needs strings, not {}", item.brief()));
    if (!first) out += text_of(separator);
    out += text_of(item);
    if (out.size() > 1'000'000) throw ExpressionError("the result is too long", "xacro.too_much");
    first = false;
  }
  return Value(std::move(out));
}

Value replace(const Value& subject, const Arguments& a) {
  const std::string &from = text_argument(a, 0, "replace"), &to = text_argument(a, 1, "replace");
  const std::string& text = text_of(subject);
  std::int64_t most = a.size() > 2 ? integer_argument(a, 2, "replace") : -1;
  if (from.empty()) throw ExpressionError("replace() of an empty string");
  std::string out;
  std::size_t begin = 0;
  for (std::size_t at; most-- != 0 && (at = text.find(from, begin)) != std::string::npos;
       begin = at + from.size()) {
    out += text.substr(begin, at - begin) + to;
    if (out.size() > 1'000'000) throw ExpressionError("the result is too long", "xacro.too_much");
  }
  return Value(out + text.substr(begin));
}

Value stripped(const Value& subject, const Arguments& a, bool left, bool right) {
  const std::string& text = text_of(subject);
  const bool given = !a.empty() && !a[0].is<Value::None>();
  const std::string_view characters = given ? std::string_view(text_argument(a, 0, "strip")) : kBlanks;
  const std::size_t begin = left ? text.find_first_not_of(characters) : 0;
  if (begin == std::string::npos) return Value("");
  const std::size_t last = right ? text.find_last_not_of(characters) : text.size() - 1;
  return last == std::string::npos || text.empty() ? Value("") : Value(text.substr(begin, last - begin + 1));
}

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
}
char upper(char c) {
  return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
}
bool letter(char c) {
  return lower(c) >= 'a' && lower(c) <= 'z';
}

// ASCII letters, and those of Latin-1 in UTF-8 (C3 80 to C3 BE).
Value cased(const Value& subject, bool up) {
  std::string out = text_of(subject);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = up ? upper(out[i]) : lower(out[i]);
    if (out[i] != '\xC3' || i + 1 >= out.size()) continue;
    const auto next = static_cast<unsigned char>(out[++i]);
    const bool capital = next >= 0x80 && next <= 0x9E && next != 0x97;
    const bool small = next >= 0xA0 && next <= 0xBE && next != 0xB7;
    if (up && small) out[i] = static_cast<char>(next - 0x20);
    if (!up && capital) out[i] = static_cast<char>(next + 0x20);
  }
  return Value(std::move(out));
}

Value capitalised(const Value& subject, bool every_word) {
  std::string out = text_of(subject);
  bool begins = true;
  for (char& c : out) {
    c = begins ? upper(c) : lower(c);
    begins = every_word && !letter(c);
  }
  return Value(std::move(out));
}

bool each(const Value& subject, bool (*predicate)(char)) {
  const std::string& text = text_of(subject);
  return !text.empty() && std::all_of(text.begin(), text.end(), predicate);
}

bool affixed(const Value& subject, const Arguments& a, bool front) {
  const std::string& text = text_of(subject);
  if (a.empty()) throw ExpressionError("startswith() and endswith() need a string");
  const ValueList wanted = a[0].is<Value::Tuple>() ? a[0].values() : ValueList{a[0]};
  return std::any_of(wanted.begin(), wanted.end(), [&](const Value& v) {
    if (!v.is<std::string>()) throw ExpressionError("startswith() and endswith() need strings");
    return front ? text.starts_with(text_of(v)) : text.ends_with(text_of(v));
  });
}

Value found(const Value& subject, const Arguments& a, bool last, bool required) {
  const std::string &text = text_of(subject), &what = text_argument(a, 0, "find");
  const std::size_t at = last ? text.rfind(what) : text.find(what);
  if (at == std::string::npos) {
    if (required) throw ExpressionError(fmt::format("{} is not in {}", a[0].brief(), subject.brief()));
    return Value(std::int64_t{-1});
  }
  return value_of_count(count_characters(std::string_view(text).substr(0, at)));
}

Value justified(const Value& subject, const Arguments& a, const char* align) {
  const std::int64_t width = integer_argument(a, 0, "just");
  const std::string fill = a.size() > 1 ? text_argument(a, 1, "just") : " ";
  if (count_characters(fill) != 1) throw ExpressionError("a fill must be one character");
  return Value(format_value(subject, fill + align + std::to_string(std::max<std::int64_t>(0, width))));
}

Value zero_filled(const Value& subject, const Arguments& a) {
  const std::string& text = text_of(subject);
  const auto width =
      static_cast<std::size_t>(std::clamp<std::int64_t>(integer_argument(a, 0, "zfill"), 0, 10'000));
  const std::size_t length = count_characters(text);
  if (length >= width) return subject;
  const bool sign = text.starts_with('-') || text.starts_with('+');
  return Value(text.substr(0, sign ? 1 : 0) + std::string(width - length, '0') + text.substr(sign ? 1 : 0));
}

Value counted(const Value& subject, const Arguments& a) {
  const std::string &text = text_of(subject), &what = text_argument(a, 0, "count");
  if (what.empty()) return value_of_count(count_characters(text) + 1);
  std::size_t out = 0;
  for (std::size_t i = 0; (i = text.find(what, i)) != std::string::npos; i += what.size()) ++out;
  return value_of_count(out);
}

Value without_affix(const Value& subject, const Arguments& a, bool front) {
  const std::string &text = text_of(subject), &affix = text_argument(a, 0, "removeprefix");
  if (front && text.starts_with(affix)) return Value(text.substr(affix.size()));
  if (!front && text.ends_with(affix)) return Value(text.substr(0, text.size() - affix.size()));
  return subject;
}

Methods string_methods() {
  using V = const Value&;
  using A = const Arguments&;
  static constexpr NamedMethod kTable[] = {
      {"lower", [](V t, A) { return cased(t, false); }},
      {"casefold", [](V t, A) { return cased(t, false); }},
      {"upper", [](V t, A) { return cased(t, true); }},
      {"capitalize", [](V t, A) { return capitalised(t, false); }},
      {"title", [](V t, A) { return capitalised(t, true); }},
      {"strip", [](V t, A a) { return stripped(t, a, true, true); }},
      {"lstrip", [](V t, A a) { return stripped(t, a, true, false); }},
      {"rstrip", [](V t, A a) { return stripped(t, a, false, true); }},
      {"split", split},
      {"rsplit", split_from_right},
      {"splitlines", split_lines},
      {"partition", [](V t, A a) { return partition(t, a, false); }},
      {"rpartition", [](V t, A a) { return partition(t, a, true); }},
      {"join", join},
      {"replace", replace},
      {"removeprefix", [](V t, A a) { return without_affix(t, a, true); }},
      {"removesuffix", [](V t, A a) { return without_affix(t, a, false); }},
      {"startswith", [](V t, A a) { return Value(affixed(t, a, true)); }},
      {"endswith", [](V t, A a) { return Value(affixed(t, a, false)); }},
      {"find", [](V t, A a) { return found(t, a, false, false); }},
      {"rfind", [](V t, A a) { return found(t, a, true, false); }},
      {"index", [](V t, A a) { return found(t, a, false, true); }},
      {"count", counted},
      {"ljust", [](V t, A a) { return justified(t, a, "<"); }},
      {"rjust", [](V t, A a) { return justified(t, a, ">"); }},
      {"center", [](V t, A a) { return justified(t, a, "^"); }},
      {"zfill", zero_filled},
      {"isdigit", [](V t, A) { return Value(each(t, is_digit)); }},
      {"isdecimal", [](V t, A) { return Value(each(t, is_digit)); }},
      {"isnumeric", [](V t, A) { return Value(each(t, is_digit)); }},
      {"isalpha", [](V t, A) { return Value(each(t, letter)); }},
      {"isalnum", [](V t, A) { return Value(each(t, [](char c) { return letter(c) || is_digit(c); })); }},
      {"isspace", [](V t, A) { return Value(each(t, [](char c) { return is_blank(c); })); }},
      {"islower", [](V t, A) { return Value(equal(t, cased(t, false)) && !equal(t, cased(t, true))); }},
      {"isupper", [](V t, A) { return Value(equal(t, cased(t, true)) && !equal(t, cased(t, false))); }},
  };
  return kTable;
}

Methods sequence_methods() {
  static constexpr NamedMethod kTable[] = {
      {"index",
       [](const Value& list, const Arguments& a) {
         expect_arguments(a, 1, 1, "index");
         const ValueList& items = list.values();
         const auto at =
             std::find_if(items.begin(), items.end(), [&a](const Value& v) { return equal(v, a[0]); });
         if (at == items.end()) throw ExpressionError(fmt::format("{} is not in the list", a[0].brief()));
         return value_of_count(static_cast<std::size_t>(at - items.begin()));
       }},
      {"count",
       [](const Value& list, const Arguments& a) {
         expect_arguments(a, 1, 1, "count");
         const ValueList& items = list.values();
         return value_of_count(static_cast<std::size_t>(
             std::count_if(items.begin(), items.end(), [&a](const Value& v) { return equal(v, a[0]); })));
       }},
      {"copy", [](const Value& list, const Arguments&) { return list; }},
  };
  return kTable;
}

Methods dict_methods() {
  static constexpr NamedMethod kTable[] = {
      {"keys",
       [](const Value& dict, const Arguments&) {
         ValueList out;
         dict.items(out);
         const std::string shown = "dict_keys(" + Value::list(out).repr() + ")";
         return Value::list(std::move(out), shown);
       }},
      {"values",
       [](const Value& dict, const Arguments&) {
         ValueList out;
         for (const auto& [key, value] : dict.as<Value::Dict>().entries->dict) out.push_back(value);
         const std::string shown = "dict_values(" + Value::list(out).repr() + ")";
         return Value::list(std::move(out), shown);
       }},
      {"items",
       [](const Value& dict, const Arguments&) {
         ValueList out;
         for (const auto& [key, value] : dict.as<Value::Dict>().entries->dict)
           out.push_back(Value::tuple({key, value}));
         const std::string shown = "dict_items(" + Value::list(out).repr() + ")";
         return Value::list(std::move(out), shown);
       }},
      {"get",
       [](const Value& dict, const Arguments& a) {
         expect_arguments(a, 1, 2, "get");
         const Value* entry = dict.as<Value::Dict>().entries->dict.find(a[0]);
         return entry != nullptr ? *entry : a.size() > 1 ? a[1] : Value();
       }},
      {"copy", [](const Value& dict, const Arguments&) { return dict; }},
  };
  return kTable;
}

Methods set_methods() {
  static const auto with = [](Operator op, const Value& a, const Arguments& b, const char* name) {
    return binary_operation(op, a, Value::set(items_argument(b, 0, name)));
  };
  static constexpr NamedMethod kTable[] = {
      {"union", [](const Value& s, const Arguments& a) { return with(Operator::bit_or, s, a, "union"); }},
      {"intersection",
       [](const Value& s, const Arguments& a) { return with(Operator::bit_and, s, a, "intersection"); }},
      {"difference",
       [](const Value& s, const Arguments& a) { return with(Operator::subtract, s, a, "difference"); }},
      {"symmetric_difference",
       [](const Value& s, const Arguments& a) {
         return with(Operator::bit_xor, s, a, "symmetric_difference");
       }},
      {"issubset",
       [](const Value& s, const Arguments& a) {
         return Value(compare_values(Operator::less_equal, s, Value::set(items_argument(a, 0, "issubset"))));
       }},
  };
  return kTable;
}

[[noreturn]] void unknown(const Value& object, std::string_view name, const std::vector<std::string>& names) {
  for (const std::string_view in_place : {"append", "extend", "insert", "pop", "remove", "sort", "reverse",
                                          "clear", "update", "setdefault", "add"}) {
    if (name == in_place && !object.is<std::string>())
      throw ExpressionError(fmt::format("'{}' would modify a {} in place, which doppel does not support; "
                                        "create a new one, as in a + [b], sorted(a), dict(a, b=1)",
                                        name, object.type_name()),
                            "xacro.attribute");
  }
  throw ExpressionError(fmt::format("{} ({}) has no '{}'{}", object.brief(), object.type_name(), name,
                                    did_you_mean(name, names)),
                        "xacro.attribute");
}

Methods methods_of(const Value& object) {
  if (object.is<std::string>()) return string_methods();
  if (object.is<Value::Dict>()) return dict_methods();
  if (object.sequence()) return sequence_methods();
  return object.is<Value::Set>() ? set_methods() : Methods();
}

Value of_dict(const Value::Dict& dict, std::string_view name) {
  const Value* const entry = dict.entries->dict.find(Value(std::string(name)));
  if (entry != nullptr && dict.dotted) return *entry;
  if (entry != nullptr)
    throw ExpressionError(
        fmt::format("entries of a dict are not attributes; write ['{}'], or xacro.dotify(...)", name),
        "xacro.attribute");
  std::vector<std::string> names;
  for (const auto& [key, value] : dict.entries->dict) names.push_back(key.str());
  throw ExpressionError(fmt::format("unknown '{}'{}", name, did_you_mean(name, names)), "xacro.attribute");
}

// str.upper, for map().
Value method_of_any(std::string_view name) {
  return Value::function(std::string(name), [name = std::string(name)](ValueList& a, KeywordArguments& k) {
    if (a.empty()) throw ExpressionError(fmt::format("{}() needs an argument", name));
    const Value method = get_attribute(a[0], name);
    ValueList rest(a.begin() + 1, a.end());
    return (*method.as<Value::Function>().call)(rest, k);
  });
}

}  // namespace

Method find_method(const Value& object, std::string_view name) {
  for (const auto& [known, method] : methods_of(object)) {
    if (known == name) return method;
  }
  return nullptr;
}

const Value* find_attribute(const Value& object, const Value& key) {
  const std::string& name = key.as<std::string>();
  if (object.is<Value::Dict>()) {
    const Value::Dict& dict = object.as<Value::Dict>();
    return dict.dotted && find_method(object, name) == nullptr ? find_index(object, key) : nullptr;
  }
  return object.is<Value::Object>() ? object.as<Value::Object>().object->find(name) : nullptr;
}

Value get_attribute(const Value& object, std::string_view name) {
  if (const Method method = find_method(object, name)) {
    return Value::function(std::string(name),
                           [object, method](ValueList& a, KeywordArguments&) { return method(object, a); });
  }
  if (object.is<std::string>() && name == "format") {
    return Value::function("format", [object](ValueList& a, KeywordArguments& k) {
      return Value(brace_format(text_of(object), a, k));
    });
  }
  if (object.is<Value::Object>()) {
    const Value::Object& inner = object.as<Value::Object>();
    if (const Value* known = inner.object->find(name)) return *known;
    throw ExpressionError(fmt::format("name '{}' is not defined in '{}'{}", name, inner.name,
                                      did_you_mean(name, inner.object->names())),
                          "xacro.undefined_name");
  }
  if (object.is<Value::Dict>()) return of_dict(object.as<Value::Dict>(), name);
  if (object.is<double>() && name == "is_integer") {
    return Value::function("is_integer", [object](ValueList&, KeywordArguments&) {
      return Value(std::isfinite(object.real()) && std::floor(object.real()) == object.real());
    });
  }
  if (object.is<Value::Function>() && object.as<Value::Function>().type) return method_of_any(name);
  std::vector<std::string> names;
  for (const auto& [known, method] : methods_of(object)) names.emplace_back(known);
  std::sort(names.begin(), names.end());
  unknown(object, name, names);
}

}  // namespace doppel
