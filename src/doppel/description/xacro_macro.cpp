#include "doppel/description/xacro_macro.h"

#include <fmt/format.h>

namespace doppel::xacro {
namespace {

bool blank(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

}  // namespace

std::vector<Macro::Parameter> parse_parameters(const std::string& text, const SourceLocation& where) {
  std::vector<Macro::Parameter> out;
  std::size_t i = 0;
  while (true) {
    while (i < text.size() && blank(text[i])) ++i;
    if (i >= text.size()) return out;
    Macro::Parameter parameter;
    const std::size_t begin = i;
    while (i < text.size() && !blank(text[i]) && text[i] != '=' &&
           !(text[i] == ':' && i + 1 < text.size() && text[i + 1] == '='))
      ++i;
    parameter.name = text.substr(begin, i - begin);
    const bool assigned = i < text.size() && !blank(text[i]);
    if (assigned) {
      i += text[i] == ':' ? 2 : 1;
      if (i < text.size() && text[i] == '^') {
        parameter.forwards = true;
        ++i;
        if (i < text.size() && text[i] == '|')
          ++i;
        else if (i < text.size() && !blank(text[i]))
          throw InputError("xacro.parameters", where,
                           fmt::format("'^' of '{}' is followed by something else than '|'", parameter.name));
      }
      // Up to the next blank that is outside of quotes and ${...}; quotes around the whole are taken off.
      std::string value;
      char quote = 0;
      int braces = 0;
      const std::size_t from = i;
      for (; i < text.size() && (quote != 0 || braces > 0 || !blank(text[i])); ++i) {
        const char c = text[i];
        if (quote == 0 && (c == '\'' || c == '"'))
          quote = c;
        else if (c == quote)
          quote = 0;
        if (c == '{') ++braces;
        if (c == '}') --braces;
        value += c;
      }
      if (quote != 0)
        throw InputError("xacro.parameters", where,
                         fmt::format("the default of '{}' has no closing quote", parameter.name));
      const bool enclosed = value.size() >= 2 && (value[0] == '\'' || value[0] == '"') &&
                            value.back() == value[0] && value.find(value[0], 1) == value.size() - 1;
      if (enclosed) value = value.substr(1, value.size() - 2);
      if (!parameter.forwards || i > from) parameter.fallback = value;
    }
    if (parameter.name.empty())
      throw InputError("xacro.parameters", where, fmt::format("'{}' is no list of parameters", text));
    out.push_back(std::move(parameter));
  }
}

}  // namespace doppel::xacro
