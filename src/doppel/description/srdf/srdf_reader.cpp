#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <sstream>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/description/srdf/srdf.h"
#include "doppel/description/urdf/load.h"
#include "doppel/description/urdf/urdf_reader.h"

namespace doppel {
namespace {

// An element with its attributes, and the elements inside it.
struct SrdfElement {
  std::string_view name, attributes, children;
};
constexpr std::array kSrdfElements{
    SrdfElement{"robot", "name version",
                "virtual_joint group group_state end_effector passive_joint joint_property "
                "disable_default_collisions disable_collisions enable_collisions link_sphere_approximation"},
    SrdfElement{"virtual_joint", "name type parent_frame child_link", ""},
    SrdfElement{"group", "name", "link joint chain group"},
    SrdfElement{"group_state", "name group", "joint"},
    SrdfElement{"end_effector", "name parent_link group parent_group", ""},
    SrdfElement{"passive_joint", "name", ""},
    SrdfElement{"joint_property", "joint_name property_name value", ""},
    SrdfElement{"disable_default_collisions", "link", ""},
    SrdfElement{"disable_collisions", "link1 link2 reason", ""},
    SrdfElement{"enable_collisions", "link1 link2 reason", ""},
    SrdfElement{"link_sphere_approximation", "link", "sphere"},
    SrdfElement{"link", "name", ""},
    SrdfElement{"joint", "name value", ""},
    SrdfElement{"chain", "base_link tip_link", ""},
    SrdfElement{"sphere", "center radius", ""},
};

const SrdfElement* srdf_element(std::string_view name) {
  const auto* const found = std::find_if(kSrdfElements.begin(), kSrdfElements.end(),
                                         [name](const SrdfElement& element) { return element.name == name; });
  return found == kSrdfElements.end() ? nullptr : found;
}

std::vector<std::string> names_in(std::string_view list) {
  std::istringstream texts{std::string(list)};
  return {std::istream_iterator<std::string>(texts), {}};
}

class SrdfReader {
 public:
  explicit SrdfReader(Diagnostics& diagnostics) : diagnostics_(diagnostics) {}

  SrdfDescription read(const XmlNode& root) {
    out_.robot = UrdfReader::optional(root, "name");
    out_.source = root.where;
    for (const XmlNode* child : known_children(root)) read_element(*child);
    return std::move(out_);
  }

 private:
  // A faulty element is omitted, and the others are read.
  [[nodiscard]] UrdfReader reader() {
    return {diagnostics_, "srdf.element", "planners leave the element out"};
  }

  void check_attributes(const XmlNode& node) {
    const std::vector<std::string> names = names_in(srdf_element(node.name)->attributes);
    for (const XmlAttribute& attribute : node.attributes) {
      if (std::ranges::count(names, attribute.name) == 0 && !attribute.name.starts_with("xmlns"))
        unknown(attribute.where, fmt::format("<{}> has no attribute '{}'", node.name, attribute.name),
                did_you_mean(attribute.name, names));
    }
  }

  // The children that the element can have, after warnings about the others and about unknown attributes.
  std::vector<const XmlNode*> known_children(const XmlNode& node) {
    check_attributes(node);
    const std::vector<std::string> names = names_in(srdf_element(node.name)->children);
    std::vector<const XmlNode*> children;
    for (const XmlNode& child : node.children) {
      if (child.kind != XmlNode::Kind::element) continue;
      if (std::ranges::count(names, child.name) != 0) {
        children.push_back(&child);
      } else {
        unknown(child.where, fmt::format("<{}> has no element '{}'", node.name, child.name),
                did_you_mean(child.name, names));
      }
    }
    return children;
  }

  void unknown(const SourceLocation& where, const std::string& message, const std::string& nearest) {
    diagnostics_.warning("srdf.unknown", where, message + nearest, "correct the name, or remove it");
  }

  void read_element(const XmlNode& node) {
    if (node.is("group")) return read_group(node);
    if (node.is("group_state")) return read_state(node);
    if (node.is("link_sphere_approximation")) return read_spheres(node);
    known_children(node);
    if (node.is("virtual_joint")) return read_virtual_joint(node);
    if (node.is("end_effector")) return read_end_effector(node);
    if (node.is("joint_property")) return read_property(node);
    if (node.is("passive_joint")) return add_reference(node, "name", out_.passive_joints);
    if (node.is("disable_default_collisions")) return add_reference(node, "link", out_.unchecked_links);
    read_pair(node, node.is("disable_collisions") ? out_.disabled : out_.enabled);
  }

  void add_reference(const XmlNode& node, const char* attribute, std::vector<SrdfReference>& list) {
    UrdfReader read = reader();
    SrdfReference reference{read.required(node, attribute), node.where};
    if (!read.faulty()) list.push_back(std::move(reference));
  }

  void read_group(const XmlNode& node) {
    UrdfReader read = reader();
    SrdfGroup group{.name = read.required(node, "name"), .source = node.where};
    for (const XmlNode* child : known_children(node)) {
      // The name of another group; as an element below <robot> it would have children.
      child->is("group") ? check_attributes(*child) : static_cast<void>(known_children(*child));
      if (child->is("link")) add_reference(*child, "name", group.links);
      if (child->is("joint")) add_reference(*child, "name", group.joints);
      if (child->is("group")) add_reference(*child, "name", group.groups);
      if (child->is("chain")) add_chain(*child, group.chains);
    }
    if (!read.faulty()) out_.groups.push_back(std::move(group));
  }

  void add_chain(const XmlNode& node, std::vector<SrdfChain>& list) {
    UrdfReader read = reader();
    SrdfChain chain{read.required(node, "base_link"), read.required(node, "tip_link"), node.where};
    if (!read.faulty()) list.push_back(std::move(chain));
  }

  void read_state(const XmlNode& node) {
    UrdfReader read = reader();
    SrdfGroupState state{
        .name = read.required(node, "name"), .group = read.required(node, "group"), .source = node.where};
    for (const XmlNode* child : known_children(node)) {
      known_children(*child);
      add_value(*child, state.values);
    }
    if (!read.faulty()) out_.states.push_back(std::move(state));
  }

  // A joint with several positions has all of them in one attribute.
  void add_value(const XmlNode& node, std::vector<SrdfJointValue>& list) {
    UrdfReader read = reader();
    SrdfJointValue value{read.required(node, "name"), {}, node.where};
    std::istringstream texts(read.required(node, "value"));
    for (std::string text; texts >> text;) {
      const auto number = parse_number(text);
      if (number)
        value.values.push_back(*number);
      else
        read.fault("srdf.element", node.where,
                   fmt::format("value=\"{}\" of <joint> is not a finite number", text),
                   "write it in rad or m, with a decimal point");
    }
    if (!read.faulty()) list.push_back(std::move(value));
  }

  void read_virtual_joint(const XmlNode& node) {
    UrdfReader read = reader();
    SrdfVirtualJoint joint{read.required(node, "name"), read.required(node, "type"),
                           read.required(node, "parent_frame"), read.required(node, "child_link"),
                           node.where};
    static const std::vector<std::string> kTypes = {"fixed", "planar", "floating"};
    if (!read.faulty() && std::ranges::count(kTypes, joint.type) == 0)
      read.fault("srdf.element", node.where,
                 fmt::format("'{}' is not a type of a virtual joint{}", joint.type,
                             did_you_mean(joint.type, kTypes)));
    if (!read.faulty()) out_.virtual_joints.push_back(std::move(joint));
  }

  void read_end_effector(const XmlNode& node) {
    UrdfReader read = reader();
    SrdfEndEffector effector{read.required(node, "name"), read.required(node, "parent_link"),
                             read.required(node, "group"), UrdfReader::optional(node, "parent_group"),
                             node.where};
    if (!read.faulty()) out_.end_effectors.push_back(std::move(effector));
  }

  void read_property(const XmlNode& node) {
    UrdfReader read = reader();
    SrdfJointProperty property{read.required(node, "joint_name"), read.required(node, "property_name"),
                               read.required(node, "value"), node.where};
    if (!read.faulty()) out_.properties.push_back(std::move(property));
  }

  void read_pair(const XmlNode& node, std::vector<SrdfLinkPair>& list) {
    UrdfReader read = reader();
    SrdfLinkPair pair{read.required(node, "link1"), read.required(node, "link2"),
                      UrdfReader::optional(node, "reason"), node.where};
    if (!read.faulty()) list.push_back(std::move(pair));
  }

  void read_spheres(const XmlNode& node) {
    UrdfReader read = reader();
    SrdfSpheres cover{.link = read.required(node, "link"), .source = node.where};
    for (const XmlNode* child : known_children(node)) {
      known_children(*child);
      const auto center = read.vector<3>(*child, "center");
      const auto radius = read.number(*child, "radius");
      if (!center) read.required(*child, "center");
      if (!radius) read.required(*child, "radius");
      if (radius && *radius < 0)
        read.fault("srdf.element", child->where, fmt::format("the radius {} is negative", *radius));
      if (center && radius) cover.spheres.push_back({*center, *radius});
    }
    if (!read.faulty()) out_.spheres.push_back(std::move(cover));
  }

  Diagnostics& diagnostics_;
  SrdfDescription out_;
};

}  // namespace

const SrdfGroup* SrdfDescription::find_group(std::string_view name) const {
  const auto found = std::ranges::find(groups, name, &SrdfGroup::name);
  return found == groups.end() ? nullptr : &*found;
}

SrdfDescription read_srdf(const XmlNode& root, Diagnostics& diagnostics) {
  if (!root.is("robot"))
    throw InputError("srdf.no_robot", root.where,
                     fmt::format("the root element is <{}>, not <robot>", root.name),
                     "give an SRDF file, or a xacro file that expands to one");
  return SrdfReader(diagnostics).read(root);
}

SrdfDescription load_srdf(const std::filesystem::path& file, PackageResolver& resolver,
                          Diagnostics& diagnostics) {
  return read_srdf(expand_description(file, {}, resolver, diagnostics).root, diagnostics);
}

}  // namespace doppel
