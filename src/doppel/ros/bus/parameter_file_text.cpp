#include "doppel/ros/bus/parameter_file_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <map>
#include <string_view>

namespace doppel {
namespace {

// Plain where YAML reads the same text again, else quoted.
std::string text_in_yaml(const std::string& text) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || std::strchr("_/.-", c) != nullptr;
  };
  if (!text.empty() && text.front() != '-' && std::ranges::all_of(text, is_plain) &&
      parse_parameter(text) == ParameterValue(text))
    return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (static_cast<unsigned char>(c) < ' ') {
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string in_yaml(const ParameterValue& value) {
  if (const auto* const text = std::get_if<std::string>(&value)) return text_in_yaml(*text);
  const auto* const texts = std::get_if<std::vector<std::string>>(&value);
  if (texts == nullptr) return to_string(value);
  std::vector<std::string> out;
  for (const std::string& text : *texts) out.push_back(text_in_yaml(text));
  return fmt::format("[{}]", fmt::join(out, ", "));
}

struct Branch {
  std::map<std::string, Branch> below;
  std::string value;
};

void print_branch(const Branch& branch, std::size_t indent, std::string& out) {
  for (const auto& [name, child] : branch.below) {
    out += std::string(indent, ' ') + name + ":" + (child.value.empty() ? "\n" : " " + child.value + "\n");
    print_branch(child, indent + 2, out);
  }
}

}  // namespace

std::string parameter_file_text(const std::string& node,
                                const std::vector<std::pair<std::string, ParameterValue>>& parameters) {
  Branch root;
  for (const auto& [name, value] : parameters) {
    if (std::holds_alternative<std::monostate>(value)) continue;
    Branch* branch = &root;
    std::string_view rest = name;
    for (std::size_t dot = rest.find('.'); dot != std::string_view::npos; dot = rest.find('.')) {
      branch = &branch->below[std::string(rest.substr(0, dot))];
      rest.remove_prefix(dot + 1);
    }
    branch->below[std::string(rest)].value = in_yaml(value);
  }
  std::string out = fmt::format("{}:\n  ros__parameters:\n", node);
  constexpr std::size_t kIndent = 4;
  print_branch(root, kIndent, out);
  return out;
}

}  // namespace doppel
