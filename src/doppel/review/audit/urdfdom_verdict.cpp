#include "doppel/review/audit/urdfdom_verdict.h"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <set>

#include "doppel/base/core/text.h"
#include "doppel/description/urdf/urdf_reader.h"

namespace doppel {
namespace {

// True if one number consumes the whole stream: blanks before it, none behind.
bool is_double(std::string_view text) {
  return !text.empty() && std::string_view(" \t\r\n").find(text.back()) == std::string_view::npos &&
         parse_number(text).has_value();
}

class Parser {
 public:
  UrdfdomVerdict parse(const XmlNode& root) {
    verdict_.ok = robot(root);
    return std::move(verdict_);
  }

 private:
  template <class... Args>
  bool fail(fmt::format_string<Args...> format, Args&&... args) {
    verdict_.messages.push_back(fmt::format(format, std::forward<Args>(args)...));
    return false;
  }

  // -- numbers
  bool numbers(const std::string& text, std::size_t count, std::string_view kind, std::string& why) {
    std::size_t found = 0;
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find(' ', begin), text.size());
      const std::string piece = text.substr(begin, end - begin);
      begin = end + 1;
      if (piece.empty()) continue;
      if (!is_double(piece)) {
        why =
            fmt::format("Unable to parse component [{}] to a double (while parsing a {} value)", piece, kind);
        return false;
      }
      ++found;
    }
    if (found == count) return true;
    why = fmt::format("Parser found {} elements but {} expected while parsing {} [{}]", found, count, kind,
                      text);
    return false;
  }
  // Present attributes must be numbers.
  bool optional_numbers(const XmlNode& node, std::initializer_list<const char*> names) {
    for (const char* name : names) {
      const XmlAttribute* a = node.find(name);
      if (a != nullptr && !is_double(a->value))
        return fail("{} value ({}) is not a valid float", name, a->value);
    }
    return true;
  }
  bool pose(const XmlNode& parent) {
    const XmlNode* origin = parent.first("origin");
    if (origin == nullptr) return true;
    std::string why;
    for (const char* name : {"xyz", "rpy"}) {
      const XmlAttribute* a = origin->find(name);
      if (a != nullptr && !numbers(a->value, 3, "vector", why)) return fail("{}", why);
    }
    return true;
  }

  // -- links
  bool material(const XmlNode& node, bool only_name_is_ok) {
    const XmlAttribute* name = node.find("name");
    if (name == nullptr) return fail("Material must contain a name attribute");
    const XmlNode *texture = node.first("texture"), *color = node.first("color");
    const bool has_file = texture != nullptr && texture->find("filename") != nullptr;
    bool has_rgb = false;
    if (const XmlAttribute* rgba = color == nullptr ? nullptr : color->find("rgba")) {
      std::string why;
      has_rgb = numbers(rgba->value, 4, "color", why);
      if (!has_rgb) fail("Material [{}] has malformed color rgba values: {}", name->value, why);
    }
    if (has_rgb || has_file) return true;
    if (only_name_is_ok) return false;
    fail("Material [{}] color has no rgba", name->value);
    return fail("Material [{}] not defined in file", name->value);
  }

  bool shape_number(const XmlNode& shape, const char* name) {
    const std::string& value = shape.find(name)->value;
    return is_double(value) || fail("{} [{}] is not a valid float", name, value);
  }
  bool geometry(const XmlNode& parent) {
    const XmlNode* node = parent.first("geometry");
    if (node == nullptr) return false;
    const XmlNode* shape = nullptr;
    for (const XmlNode& child : node->children) {
      if (shape == nullptr && child.kind == XmlNode::Kind::element) shape = &child;
    }
    if (shape == nullptr) return fail("Geometry tag contains no child element.");
    std::string why;
    if (shape->name == "sphere") {
      if (shape->find("radius") == nullptr) return fail("Sphere shape must have a radius attribute");
      return shape_number(*shape, "radius");
    }
    if (shape->name == "box") {
      const XmlAttribute* size = shape->find("size");
      if (size == nullptr) return fail("Box shape has no size attribute");
      return numbers(size->value, 3, "vector", why) || fail("{}", why);
    }
    if (shape->name == "cylinder") {
      if (shape->find("length") == nullptr || shape->find("radius") == nullptr) {
        return fail("Cylinder shape must have both length and radius attributes");
      }
      return shape_number(*shape, "length") && shape_number(*shape, "radius");
    }
    if (shape->name == "mesh") {
      if (shape->find("filename") == nullptr) return fail("Mesh must contain a filename attribute");
      const XmlAttribute* scale = shape->find("scale");
      return scale == nullptr || numbers(scale->value, 3, "vector", why) ||
             fail("Mesh scale was specified, but could not be parsed: {}", why);
    }
    return fail("Unknown geometry type '{}'", shape->name);
  }

  bool inertial(const XmlNode& node) {
    if (!pose(node)) return false;
    const XmlNode *mass = node.first("mass"), *inertia = node.first("inertia");
    if (mass == nullptr) return fail("Inertial element must have a mass element");
    const XmlAttribute* value = mass->find("value");
    if (value == nullptr) return fail("Inertial: mass element must have value attribute");
    if (!is_double(value->value)) return fail("Inertial: mass [{}] is not a float", value->value);
    if (inertia == nullptr) return fail("Inertial element must have inertia element");
    for (const char* name : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) {
      const XmlAttribute* a = inertia->find(name);
      if (a == nullptr) return fail("Inertial: inertia element missing {} attribute", name);
      if (!is_double(a->value)) return fail("Inertial: inertia element {} is not a valid double", name);
    }
    return true;
  }

  struct VisualMaterial {
    std::string name;
    bool defined = false;
  };
  std::optional<VisualMaterial> visual(const XmlNode& node) {
    if (!pose(node) || !geometry(node)) return std::nullopt;
    VisualMaterial out;
    if (const XmlNode* m = node.first("material")) {
      const XmlAttribute* name = m->find("name");
      if (name == nullptr) {
        fail("Visual material must contain a name attribute");
        return std::nullopt;
      }
      out = {name->value, material(*m, true)};
    }
    return out;
  }

  // A part of a link that urdfdom fails to read is left out; parsing continues.
  void link(const XmlNode& node, std::string& name, std::vector<VisualMaterial>& visuals) {
    const XmlAttribute* attribute = node.find("name");
    if (attribute == nullptr) {
      fail("No name given for the link.");
      return;
    }
    name = attribute->value;
    const XmlNode* weight = node.first("inertial");
    if (weight != nullptr && !inertial(*weight)) {
      fail("Could not parse inertial element for Link [{}]", name);
      return;
    }
    for (const XmlNode& child : node.children) {
      if (!child.is("visual")) continue;
      auto read = visual(child);
      if (!read) {
        fail("Could not parse visual element for Link [{}]", name);
        return;
      }
      visuals.push_back(std::move(*read));
    }
    for (const XmlNode& child : node.children) {
      if (child.is("collision") && !(pose(child) && geometry(child))) {
        fail("Could not parse collision element for Link [{}]", name);
        return;
      }
    }
  }

  bool links(const XmlNode& root) {
    for (const XmlNode& node : root.children) {
      if (!node.is("link")) continue;
      std::string name;
      std::vector<VisualMaterial> visuals;
      link(node, name, visuals);
      if (links_.contains(name)) return fail("link '{}' is not unique.", name);
      for (std::size_t i = 0; i < visuals.size(); ++i) {
        // The first one is looked up twice: as the link's visual, and among all of them.
        for (int time = i == 0 ? 0 : 1; time < 2; ++time) assign(visuals[i], name);
      }
      links_.insert(name);
    }
    return !links_.empty() || fail("No link elements found in urdf file");
  }
  void assign(const VisualMaterial& m, const std::string& link_name) {
    if (m.name.empty() || materials_.contains(m.name)) return;
    if (m.defined)
      materials_.insert(m.name);
    else
      fail("link '{}' material '{}' undefined.", link_name, m.name);
  }

  // -- joints
  bool joint_parts(const XmlNode& node, const std::string& name, const std::string& type) {
    if (const XmlNode* limit = node.first("limit")) {
      bool good = optional_numbers(*limit, {"lower", "upper"});
      for (const char* need : {"effort", "velocity"}) {
        if (!good) break;
        good = limit->find(need) == nullptr ? fail("joint limit: no {}", need)
                                            : optional_numbers(*limit, {need});
      }
      if (!good) return fail("Could not parse limit element for joint [{}]", name);
    } else if (type == "revolute") {
      return fail("Joint [{}] is of type REVOLUTE but it does not specify limits", name);
    } else if (type == "prismatic") {
      return fail("Joint [{}] is of type PRISMATIC without limits", name);
    }
    if (const XmlNode* safety = node.first("safety_controller")) {
      bool good = optional_numbers(*safety, {"soft_lower_limit", "soft_upper_limit", "k_position"});
      if (good)
        good = safety->find("k_velocity") == nullptr ? fail("joint safety: no k_velocity")
                                                     : optional_numbers(*safety, {"k_velocity"});
      if (!good) return fail("Could not parse safety element for joint [{}]", name);
    }
    if (const XmlNode* calibration = node.first("calibration")) {
      if (!optional_numbers(*calibration, {"rising", "falling"}))
        return fail("Could not parse calibration element for joint  [{}]", name);
    }
    if (const XmlNode* mimic = node.first("mimic")) {
      const bool good = mimic->find("joint") == nullptr ? fail("joint mimic: no mimic joint specified")
                                                        : optional_numbers(*mimic, {"multiplier", "offset"});
      if (!good) return fail("Could not parse mimic element for joint  [{}]", name);
    }
    if (const XmlNode* dynamics = node.first("dynamics")) {
      bool good = optional_numbers(*dynamics, {"damping", "friction"});
      if (good && dynamics->find("damping") == nullptr && dynamics->find("friction") == nullptr) {
        good = fail("joint dynamics element specified with no damping and no friction");
      }
      if (!good) return fail("Could not parse joint_dynamics element for joint [{}]", name);
    }
    return true;
  }

  bool joint(const XmlNode& node, std::string& name) {
    const XmlAttribute *named = node.find("name"), *typed = node.find("type");
    if (named == nullptr) return fail("unnamed joint found");
    name = named->value;
    if (!pose(node)) return fail("Malformed parent origin element for joint [{}]", name);
    if (typed == nullptr) return fail("joint [{}] has no type, check to see if it's a reference.", name);
    static const std::set<std::string_view> types{"planar",     "floating",  "revolute",
                                                  "continuous", "prismatic", "fixed"};
    const std::string& type = typed->value;
    if (!types.contains(type)) return fail("Joint [{}] has no known type [{}]", name, type);
    const XmlNode* axis = type == "fixed" || type == "floating" ? nullptr : node.first("axis");
    if (const XmlAttribute* xyz = axis == nullptr ? nullptr : axis->find("xyz")) {
      std::string why;
      if (!numbers(xyz->value, 3, "vector", why))
        return fail("Malformed axis element for joint [{}]: {}", name, why);
    }
    return joint_parts(node, name, type);
  }

  struct Ends {
    std::string parent, child;
  };
  bool joints(const XmlNode& root) {
    for (const XmlNode& node : root.children) {
      if (!node.is("joint")) continue;
      std::string name;
      if (!joint(node, name)) return fail("joint xml is not initialized correctly");
      const auto end = [&](const char* tag) {
        const XmlNode* element = node.first(tag);
        return element == nullptr ? "" : UrdfReader::optional(*element, "link");
      };
      if (!joints_.emplace(name, Ends{end("parent"), end("child")}).second)
        return fail("joint '{}' is not unique.", name);
    }
    return true;
  }

  // -- the tree, by the order of names
  bool tree() {
    std::set<std::string> children;
    for (const auto& [name, ends] : joints_) {
      if (ends.parent.empty() || ends.child.empty()) {
        return fail("Failed to build tree: Joint [{}] is missing a parent and/or child link specification.",
                    name);
      }
      if (!links_.contains(ends.child))
        return fail("Failed to build tree: child link [{}] of joint [{}] not found", ends.child, name);
      if (!links_.contains(ends.parent)) {
        return fail(
            "Failed to build tree: parent link [{0}] of joint [{1}] not found.  This is not valid according "
            "to the "
            "URDF spec. Every link you refer to from a joint needs to be explicitly defined in the robot "
            "description. "
            "To fix this problem you can either remove this joint [{1}] from your urdf file, or add \"<link "
            "name=\"{0}\" />\" to your urdf file.",
            ends.parent, name);
      }
      children.insert(ends.child);
    }
    const std::string* root = nullptr;
    for (const std::string& link_name : links_) {
      if (children.contains(link_name)) continue;
      if (root != nullptr)
        return fail("Failed to find root link: Two root links found: [{}] and [{}]", *root, link_name);
      root = &link_name;
    }
    return root != nullptr ||
           fail("Failed to find root link: No root link found. The robot xml is not a valid tree.");
  }

  bool robot(const XmlNode& root) {
    if (root.name != "robot") return fail("Could not find the 'robot' element in the xml file");
    if (root.find("name") == nullptr) return fail("No name given for the robot.");
    const XmlAttribute* version = root.find("version");
    if (version != nullptr && version->value != "1.0") {
      return fail("Invalid 'version' specified; only version 1.0 is currently supported");
    }
    for (const XmlNode& node : root.children) {
      if (!node.is("material")) continue;
      material(node, false);
      const std::string name = UrdfReader::optional(node, "name");
      if (!materials_.insert(name).second) return fail("material '{}' is not unique.", name);
    }
    return links(root) && joints(root) && tree();
  }

  UrdfdomVerdict verdict_;
  std::set<std::string> materials_, links_;
  std::map<std::string, Ends> joints_;
};

}  // namespace

UrdfdomVerdict urdfdom_verdict(const XmlNode& root) {
  return Parser().parse(root);
}

}  // namespace doppel
