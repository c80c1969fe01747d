#include "doppel/description/gazebo/plugin_values.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "doppel/base/core/text.h"

namespace doppel {

namespace {

std::string without_blanks(std::string text) {
  std::erase_if(text, [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; });
  return text;
}

}  // namespace

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

std::vector<double> PluginValues::numbers(std::initializer_list<std::string_view> names) {
  std::vector<double> out;
  std::istringstream words(text(names));
  for (std::string word; words >> word;) {
    const std::optional<double> value = parse_number(word);
    if (!value) {
      refuse(names, "not numbers");
      return {};
    }
    out.push_back(*value);
  }
  return out;
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

std::string PluginValues::without_tilde(const std::string& name) const {
  const XmlAttribute* const own = element_.find("name");
  return name.starts_with("~/") ? (own == nullptr ? "" : own->value + "/") + name.substr(2) : name;
}

std::string PluginValues::remapped(const std::string& name) {
  read_.insert("ros");
  const std::string relative = without_tilde(name);
  const XmlNode* const ros = element_.first("ros");
  if (ros == nullptr) return relative;
  const std::string own = absolute_topic(ros_namespace(), relative);
  for (const XmlNode& child : ros->children) {
    const std::string rule = child.is("remapping") ? child.content() : "";
    const std::size_t arrow = rule.find(":=");
    if (arrow == std::string::npos) continue;
    const std::string from = without_blanks(rule.substr(0, arrow)),
                      to = without_blanks(rule.substr(arrow + 2));
    if (absolute_topic(ros_namespace(), without_tilde(from)) != own) continue;
    applied_.insert(rule);
    return without_tilde(to);
  }
  return relative;
}

std::vector<std::string> PluginValues::unused_remappings() const {
  std::vector<std::string> out;
  const XmlNode* const ros = element_.first("ros");
  if (ros == nullptr) return out;
  for (const XmlNode& child : ros->children)
    if (child.is("remapping") && !applied_.contains(child.content())) out.push_back(child.content());
  return out;
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
