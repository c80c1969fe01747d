#include "doppel/ros/bus/parameter_edit.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <utility>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/bus/parameter_file.h"

namespace doppel {
namespace {

using Values = std::map<std::pair<std::string, std::string>, std::string>;

[[noreturn]] void refuse(const SourceLocation& where, const NumberEdit& edit, const std::string& rule,
                         const std::string& why) {
  throw InputError(rule, where,
                   edit.name + " cannot be written here without changing the form of the file" + why,
                   "write " + edit.name + ": " + edit.written + " yourself");
}

// The first byte of a line, which counts from 1.
std::size_t begin_of_line(std::string_view text, int line) {
  std::size_t out = 0;
  for (int i = 1; i < line; ++i) {
    const std::size_t end = text.find('\n', out);
    if (end == std::string_view::npos) return text.size();
    out = end + 1;
  }
  return out;
}

// The last part of a name, which is its key in the file.
std::string_view key_of(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  return dot == std::string_view::npos ? name : name.substr(dot + 1);
}

struct Place {
  std::size_t key = 0, begin = 0, end = 0;  // of the key, of the number and behind it
  bool in_flow = false;                     // {p: 1, i: 2}
};

// The place of a number that is written behind its key on one line.
std::optional<Place> number_at(const std::string& text, const SourceLocation& where, std::string_view name) {
  if (where.line < 1 || where.column < 1) return std::nullopt;
  Place out;
  const std::size_t line = begin_of_line(text, where.line);
  out.begin = line + static_cast<std::size_t>(where.column) - 1;
  if (out.begin >= text.size()) return std::nullopt;
  const std::string before = text.substr(line, out.begin - line);
  const std::string key = std::string(key_of(name)) + ":";
  const std::size_t begin = before.rfind(key);
  if (begin == std::string::npos || before.find_first_not_of(' ', begin + key.size()) != std::string::npos)
    return std::nullopt;
  const std::size_t first = before.find_first_not_of(' ');
  out.in_flow = begin != first;
  if (out.in_flow && std::string_view("{, ").find(before[begin - 1]) == std::string_view::npos)
    return std::nullopt;
  out.key = line + begin;
  char* end = nullptr;
  std::strtod(text.c_str() + out.begin, &end);
  out.end = static_cast<std::size_t>(end - text.c_str());
  constexpr std::string_view kBehind = " #\r\n,}";
  if (out.end == out.begin ||
      (out.end < text.size() && kBehind.find(text[out.end]) == std::string_view::npos))
    return std::nullopt;
  return out;
}

Values values_of(const std::string& text, const std::string& file) {
  Values out;
  const ParameterFile parameters = ParameterFile::parse(text, file);
  for (const std::string& node : parameters.nodes()) {
    const ParameterOverrides overrides = parameters.overrides_for(node, node);
    for (const ParameterOverride& one : overrides.all()) out[{node, one.name}] = to_string(one.value);
  }
  return out;
}

std::optional<ParameterOverride> find(const std::string& text, const std::string& file,
                                      const std::string& node, const std::string& name) {
  ParameterOverrides overrides = ParameterFile::parse(text, file).overrides_for("/" + node, node);
  if (const ParameterOverride* const found = overrides.find(name)) return *found;
  return std::nullopt;
}

void set_number(std::string& text, const std::string& file, const NumberEdit& edit, const std::string& rule) {
  const auto present = find(text, file, edit.node, edit.name);
  if (present) {
    const auto place = number_at(text, present->source, edit.name);
    if (!place) refuse(present->source, edit, rule, "");
    text.replace(place->begin, place->end - place->begin, edit.written);
    return;
  }
  const auto neighbour = edit.behind.empty() ? std::nullopt : find(text, file, edit.node, edit.behind);
  if (!neighbour) {
    refuse(make_location(file), edit, rule,
           edit.behind.empty() ? "" : ": it has no " + edit.behind + " of " + edit.node);
  }
  const auto place = number_at(text, neighbour->source, edit.behind);
  if (!place) refuse(neighbour->source, edit, rule, "");
  const std::string added = std::string(key_of(edit.name)) + ": " + edit.written;
  if (place->in_flow) {
    text.insert(place->end, ", " + added);
    return;
  }
  const std::size_t line = begin_of_line(text, neighbour->source.line);
  const std::string indent = text.substr(line, place->key - line);
  const std::size_t end = std::min(text.find('\n', place->end), text.size());
  const std::string newline = end > 0 && text[end - 1] == '\r' ? "\r\n" : "\n";
  if (end == text.size()) {
    text += newline + indent + added;
  } else {
    text.insert(end + 1, indent + added + newline);
  }
}

// Nothing but the wanted values has changed: an anchor may be the value of several names.
void check_only_these(const Values& before, const Values& after, const std::string& file,
                      const std::vector<NumberEdit>& edits, const std::string& rule) {
  for (const auto& [where, value] : after) {
    const std::string &node = where.first, &name = where.second;
    const auto former = before.find(where);
    if (former != before.end() && former->second == value) continue;
    const auto is_wanted = [&](const NumberEdit& edit) {
      const bool same_node =
          node == edit.node || node.ends_with("/" + edit.node) || node.find('*') != std::string::npos;
      return same_node && edit.name == name;
    };
    if (std::ranges::any_of(edits, is_wanted)) continue;
    refuse(make_location(file), edits.front(), rule,
           ": " + name + " of " + node + " has the same value by an alias");
  }
  for (const NumberEdit& edit : edits) {
    for (const auto& [where, value] : after) {
      if (where.first != edit.node || where.second != edit.name) continue;
      const double now = std::strtod(value.c_str(), nullptr),
                   wanted = std::strtod(edit.written.c_str(), nullptr);
      if (std::abs(now - wanted) > 1e-5 * std::abs(wanted))
        refuse(make_location(file), edit, rule, ": its number is also that of another name");
    }
  }
}

}  // namespace

std::string with_numbers(std::string_view text, const std::string& file, const std::vector<NumberEdit>& edits,
                         const std::string& rule) {
  std::string out(text);
  if (edits.empty()) return out;
  const Values before = values_of(out, file);
  for (const NumberEdit& edit : edits) set_number(out, file, edit, rule);
  check_only_these(before, values_of(out, file), file, edits, rule);
  return out;
}

}  // namespace doppel
