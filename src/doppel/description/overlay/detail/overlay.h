#pragma once
// Shared by the files of this module. An operation is represented by facts about its target: those that it
// depends on ("axis" -> "1 0 0"), and those that it produces. The file contains the former facts, the tree
// the present ones, and an operation is applied, recognised or rejected by comparing the two.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/base/core/overloaded.h"
#include "doppel/description/overlay/overlay.h"

namespace doppel::overlay_detail {

using Facts = std::vector<std::pair<std::string, std::string>>;

inline constexpr const char* kNone = "none";
inline constexpr std::string_view kBlanks = " \t\r\n";  // between the words of an attribute and of a tag

// -- values (values.cpp)
std::string number_text(double value);  // shortest that reads back the same; no negative zero
std::string vector_text(const Eigen::Vector3d& v);
std::optional<double> number_of(std::string_view text);
std::optional<Eigen::Vector3d> vector_of(std::string_view text);
const std::string* find_fact(const Facts& facts, std::string_view key);
void set_fact(Facts& facts, const std::string& key, std::string value);
// Equal in meaning: numbers by value, rpy by the rotation that they represent.
bool same_fact(std::string_view key, const std::string& a, const std::string& b);

// -- the tree (tree.cpp)
const XmlNode* find_named(const XmlNode& root, std::string_view element, std::string_view name);
XmlNode* find_named(XmlNode& root, std::string_view element, std::string_view name);
std::vector<std::string> names_of(const XmlNode& root, std::string_view element);
std::string attribute_of(const XmlNode& node, std::string_view name, std::string_view fallback = "");
XmlNode* child_of(XmlNode& node, std::string_view element);
XmlNode& child_or_new(XmlNode& node, const std::string& element, const SourceLocation& where);
XmlNode make_node(const std::string& element, const SourceLocation& where);
void set_attribute(XmlNode& node, const std::string& name, std::string value, const SourceLocation& where);
const XmlNode* joint_above(const XmlNode& root, std::string_view link);  // whose child the link is
std::vector<const XmlNode*> joints_below(const XmlNode& root, std::string_view link);
std::string root_link(const XmlNode& root);  // the first link without a parent; "" if there is none
std::string link_of(const XmlNode& joint, std::string_view end);  // end: "parent" or "child"

// -- values that are invalid in every description (invalid_values.cpp)
struct InvalidValue {
  std::string key;  // of the setting; empty: the value behind the operation's name
  std::string message, fix;
};
std::optional<InvalidValue> invalid_value_in(const OperationAction& action);

// -- facts (facts.cpp)
// The facts that the operation depends on or produces, in the order in which they are written.
std::vector<std::string> fact_keys(const OperationAction& action, const XmlNode& root);
// The present values; nothing where the target does not exist.
std::optional<Facts> facts_of(const OperationAction& action, const XmlNode& root,
                              const std::vector<std::string>& keys);
// The value of a fact where its part of the joint or link ("mimic", "inertial") was removed.
std::optional<std::string> value_without(std::string_view part, std::string_view key);
// Writes plain facts ("axis", "mass") of a joint or link into its element.
void write_facts(XmlNode& target, const Facts& facts, const SourceLocation& where);
// Writes those of <doppel:servo> into the <gazebo> of the joint, a new one if there is none.
void write_servo(XmlNode& root, const std::string& joint, const Facts& facts, const SourceLocation& where);
void set_target(OperationAction& action, const std::string& name);
std::string shapes_text(const XmlNode& link, std::string_view element);  // "mesh a.stl, box 1 1 1" or "none"

// -- the results of operations (results.cpp)
[[noreturn]] void impossible(const SourceLocation& where, const std::string& why,
                             const std::string& fix = "");  // throws InputError "overlay.impossible"
struct Surroundings {
  XmlNode& root;
  std::filesystem::path folder;  // of the description
  const PackageResolver* resolver = nullptr;
};
// Only the facts that the operation writes. Throws InputError where it cannot be computed.
Facts result_of(const Operation& operation, const Facts& was, const Surroundings& around);
// Applies it; `result`: the facts that are still to be written. Throws InputError "overlay.impossible".
void carry_out(const Operation& operation, const Facts& was, const Facts& result, const Surroundings& around);
double mass_factor(const ScaleMasses& action, const Facts& was);

// -- operations on the structure (structure.cpp)
void attach_to_world(XmlNode& root, const AttachToWorld& action, const SourceLocation& where);
void rename(XmlNode& root, const Rename& action);
void add_ros2_control(XmlNode& root, const AddRos2Control& action, const SourceLocation& where);
void remove(XmlNode& root, const Remove& action, const SourceLocation& where);

// -- operations on shapes (shapes.cpp)
Facts computed_inertia(const Operation& operation, const Facts& was, const Surroundings& around);
std::string replaced_collision(const ReplaceCollision& action, const SourceLocation& where,
                               const Surroundings& around);  // the fact "collision" that it produces
void replace_collision(const ReplaceCollision& action, const SourceLocation& where,
                       const Surroundings& around);

// -- files (yaml_writer.cpp, file.cpp)
std::string to_yaml(const Operation& operation);  // "- flip_axis: Revolute 3\n  why: ...\n"

}  // namespace doppel::overlay_detail
