#include "doppel/twin/detail/plugin_values.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "doppel/core/text.h"
#include "doppel/description/urdf_reader.h"

namespace doppel {

std::string absolute_topic(const std::string& name_space, const std::string& topic) {
  if (topic.starts_with('/')) return topic;
  return name_space.empty() || name_space == "/" ? "/" + topic
         : name_space.starts_with('/')           ? name_space + "/" + topic
                                                 : "/" + name_space + "/" + topic;
}

std::string valid_topic(const std::string& topic) {
  std::string out;
  for (const char c : topic) {
    const bool digit = c >= '0' && c <= '9';
    if (digit && (out.empty() || out.back() == '/')) out += '_';
    out += digit || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '/' ? c : '_';
  }
  return out;
}

std::vector<std::string> PluginValues::all(std::initializer_list<std::string_view> names) {
  std::vector<std::string> out;
  for (const XmlNode& child : element_.children) {
    if (std::ranges::find(names, child.name) == names.end()) continue;
    read_.insert(child.name);
    out.push_back(child.content());
  }
  return out;
}

std::string PluginValues::text(std::initializer_list<std::string_view> names, std::string otherwise) {
  const std::vector<std::string> found = all(names);
  return found.empty() || found.front().empty() ? otherwise : found.front();
}

void PluginValues::refuse(std::initializer_list<std::string_view> names, const char* why) {
  wrong_.push_back(fmt::format("<{}>{} ({})", *names.begin(), text(names), why));
}

std::optional<double> PluginValues::number(std::initializer_list<std::string_view> names) {
  const std::string found = text(names);
  const std::optional<double> value = parse_number(found);
  if (!value && !found.empty()) refuse(names, "not a number");
  return value;
}

double PluginValues::positive(std::initializer_list<std::string_view> names, double otherwise) {
  const auto found = number(names);
  if (found && *found > 0) return *found;
  if (found) refuse(names, "not above 0");
  return otherwise;
}

int PluginValues::positive_count(std::initializer_list<std::string_view> names, int otherwise) {
  constexpr double kMost = 1e9;
  const auto found = number(names);
  if (found && *found >= 1 && *found <= kMost && std::floor(*found) == *found)
    return static_cast<int>(*found);
  if (found) refuse(names, "not a whole number above 0");
  return otherwise;
}

bool PluginValues::flag(std::initializer_list<std::string_view> names, bool otherwise) {
  const std::string found = lowered(text(names));
  return found.empty() ? otherwise : found == "true" || found == "1";
}

std::string PluginValues::remapped(const std::string& name) {
  const XmlNode* const ros = element_.first("ros");
  read_.insert("ros");
  if (ros == nullptr) return name;
  for (const XmlNode& child : ros->children) {
    const std::string rule = child.is("remapping") ? child.content() : "";
    if (rule.starts_with(name + ":=")) return rule.substr(name.size() + 2);
  }
  return name;
}

std::string PluginValues::ros_namespace() {
  const XmlNode* const ros = element_.first("ros");
  const XmlNode* const space = ros == nullptr ? nullptr : ros->first("namespace");
  return space == nullptr ? text({"robotNamespace"}) : space->content();
}

std::string PluginValues::ros_name(const std::string& name) {
  return absolute_topic(ros_namespace(), remapped(name));
}

std::vector<std::string> PluginValues::unread() const {
  std::vector<std::string> out;
  for (const XmlNode& child : element_.children) {
    const bool fresh = std::ranges::find(out, child.name) == out.end();
    if (child.kind == XmlNode::Kind::element && !read_.contains(child.name) && fresh)
      out.push_back(child.name);
  }
  return out;
}

void PluginValues::report_wrong(const char* rule, const SourceLocation& source, const std::string& whose,
                                Diagnostics& diagnostics) const {
  if (wrong_.empty()) return;
  diagnostics.warning(rule, source,
                      fmt::format("{} has values that cannot be read, and its default is used instead: {}",
                                  whose, fmt::join(wrong_, ", ")),
                      "write plain numbers, in m and s, without a unit");
}

}  // namespace doppel
