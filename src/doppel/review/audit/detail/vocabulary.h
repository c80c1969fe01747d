#pragma once
// The elements and attributes that a description may contain, and where. Sources: the URDF XML specification
// (ros.org/wiki/urdf/XML) and urdfdom 4; ros2_control's component parser (Jazzy); transmissions of ROS 1 and
// of ros2_control; the extensions of Bullet, HEBI and others that are seen in public robots.

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace doppel::audit_rules {

enum class Content {
  elements,  // known elements only
  text,      // its text is its value
  open,      // content of another tool, not checked
};

struct ElementKind {
  std::string_view path;        // "joint/limit": with the parents that make it unique
  std::string_view attributes;  // with blanks between
  std::string_view children;
  std::string_view once;  // the children of which only one is read
  Content content = Content::elements;
};

// The kind of the element with the names from <robot> downwards, without <robot>; null: not in the vocabulary.
const ElementKind* find_kind(const std::vector<std::string_view>& path);

// Almost certainly a typo of `meant`: at most two letters differ, and less than half of the word.
bool is_near_certain_match(std::string_view written, std::string_view meant);

std::vector<std::string> words(std::string_view list);
bool has_word(std::string_view list, std::string_view word);

// The elements that may hold `element`: "<joint>, <ros2_control>/<joint>".
std::vector<std::string> homes_of(std::string_view element);

}  // namespace doppel::audit_rules
