#pragma once
// Which elements and attributes a description may hold, and where. Sources: the URDF XML specification
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
  open,      // whatever another tool reads
};

struct ElementKind {
  std::string_view path;        // "joint/limit": as far up as is needed to tell it from its namesakes
  std::string_view attributes;  // with blanks between
  std::string_view children;
  std::string_view once;  // of the children, those that only one of is read
  Content content = Content::elements;
};

// By the names from <robot> downwards, without <robot>; null: none of ours.
const ElementKind* find_kind(const std::vector<std::string_view>& path);

// Near enough to be sure that it was meant: two letters, and less than half of the word.
bool is_near_certain_match(std::string_view written, std::string_view meant);

std::vector<std::string> words(std::string_view list);
bool has_word(std::string_view list, std::string_view word);

// The elements that may hold `element`: "<joint>, <ros2_control>/<joint>".
std::vector<std::string> homes_of(std::string_view element);

}  // namespace doppel::audit_rules
