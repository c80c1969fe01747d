#pragma once
// The values of the elements of a simulator's plugin. Numbers are read strictly: what is none is reported, and the
// plugin's default is used.

#include <functional>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/xml/xml.h"
#include "doppel/export.h"

namespace doppel {

// "/left/x" for ("left", "x") and ("/left", "x"); "/x" itself.
DOPPEL_API std::string absolute_topic(const std::string& name_space, const std::string& topic);
// The nearest name that ROS 2 permits: '_' for each other character, and before a digit that begins a part.
DOPPEL_API std::string valid_topic(const std::string& topic);

class DOPPEL_API PluginValues {
 public:
  // Of the <plugin>, or of an element with such values.
  explicit PluginValues(XmlNode element) : element_(std::move(element)) {}

  [[nodiscard]] const XmlNode& element() const { return element_; }
  // Of all children with one of the names, in the order of the document.
  std::vector<std::string> all(std::initializer_list<std::string_view> names);
  std::string text(std::initializer_list<std::string_view> names, std::string otherwise = "");
  std::optional<double> number(std::initializer_list<std::string_view> names);
  // The numbers of a text; empty: there is none, or it is none.
  std::vector<double> numbers(std::initializer_list<std::string_view> names);
  double positive(std::initializer_list<std::string_view> names, double otherwise);
  int positive_count(std::initializer_list<std::string_view> names, int otherwise);
  bool flag(std::initializer_list<std::string_view> names, bool otherwise);
  // The name that <ros><remapping>from:=to</remapping></ros> gives to a topic or service. Names are compared as nodes do:
  // "~/x" is below the plugin's name, and all are in its namespace.
  std::string remapped(const std::string& name);
  // Of <ros><namespace>, or ROS 1's <robotNamespace>; empty: none.
  std::string ros_namespace();
  // The same as remapped() as an absolute name in that namespace.
  std::string ros_name(const std::string& name);
  // Rules of <remapping> that applied to no name given to remapped().
  [[nodiscard]] std::vector<std::string> unused_remappings() const;
  // The names of elements that were not read.
  [[nodiscard]] std::vector<std::string> unread() const;
  // A warning that lists the values that could not be used, if there are any. whose: "the plugin 'x'".
  void report_wrong(const char* rule, const SourceLocation& source, const std::string& whose,
                    Diagnostics& diagnostics) const;

 private:
  void refuse(std::initializer_list<std::string_view> names, const char* why);

  // "~/x" as "name/x".
  [[nodiscard]] std::string without_tilde(const std::string& name) const;

  XmlNode element_;
  std::set<std::string, std::less<>> applied_;  // rules of <remapping>
  std::set<std::string, std::less<>> read_;
  std::vector<std::string> wrong_;
};

}  // namespace doppel
