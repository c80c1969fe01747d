// The elements and attributes of a description compared with the vocabulary of its readers.
#include <algorithm>
#include <map>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/review/audit/detail/description_facts.h"
#include "doppel/review/audit/detail/rules.h"
#include "doppel/review/audit/detail/vocabulary.h"

namespace doppel::audit_rules {
namespace {

class SchemaCheck {
 public:
  explicit SchemaCheck(Findings& out) : out_(out) {}

  void robot(const XmlNode& root) {
    path_ = {"robot"};
    element(root);
  }

 private:
  void element(const XmlNode& node) {
    const ElementKind* kind = find_kind(path_);
    if (kind == nullptr) return;
    attributes(node, *kind);
    if (kind->content != Content::elements) return;
    std::map<std::string_view, const XmlNode*> first;
    for (const XmlNode& child : node.children) {
      if (child.kind == XmlNode::Kind::text) text(node, child);
      if (child.kind != XmlNode::Kind::element || child.name.find(':') != std::string::npos) continue;
      const auto [known, fresh] = first.emplace(child.name, &child);
      if (!fresh && has_word(kind->once, child.name)) repeated(node, child, *known->second);
      if (path_.size() == 1) subject_ = subject_of(child);
      path_.push_back(child.name);
      if (has_word(kind->children, child.name))
        element(child);
      else
        unknown(node, child, *kind);
      path_.pop_back();
    }
  }

  static std::string subject_of(const XmlNode& node) {
    const XmlAttribute* name = node.find("name");
    if (name == nullptr) name = node.find("reference");
    return name == nullptr ? fmt::format("<{}>", node.name) : fmt::format("{} '{}'", node.name, name->value);
  }

  std::string subject() const { return path_.size() == 1 ? "the robot" : subject_; }

  void attributes(const XmlNode& node, const ElementKind& kind) {
    for (const XmlAttribute& a : node.attributes) {
      if (a.name.find(':') != std::string::npos || a.name == "xmlns" || has_word(kind.attributes, a.name))
        continue;
      if (kind.content == Content::open && kind.attributes.empty()) continue;
      const std::vector<std::string> valid = words(kind.attributes);
      const auto near = nearest_name(a.name, valid);
      const bool meant = near && node.find(*near) == nullptr;
      out_.add("schema.attribute", meant ? Severity::warning : Severity::note, subject(), a.where,
               fmt::format("<{}> has no attribute '{}'{}", node.name, a.name,
                           meant ? did_you_mean(a.name, valid) : ""),
               meant ? fmt::format("write {}=\"{}\"", *near, a.value) : "");
    }
  }

  void unknown(const XmlNode& parent, const XmlNode& child, const ElementKind& kind) {
    const std::vector<std::string> homes = homes_of(child.name);
    const std::vector<std::string> valid = words(kind.children);
    const auto near = nearest_name(child.name, valid);
    const bool meant = near && is_near_certain_match(child.name, *near);
    // <limits> in a joint without <limit> is a typo, although <ros2_control> has an element of that name.
    if (!homes.empty() && !(meant && parent.first(*near) == nullptr)) {
      // A colour of an element that is not drawn has no effect.
      const Severity severity = child.name == "material" ? Severity::note : Severity::warning;
      out_.add("schema.misplaced", severity, subject(), child.where,
               fmt::format("<{}> is in <{}>, where it is ignored", child.name, parent.name),
               fmt::format("it belongs in {}", fmt::join(homes, " or ")));
      return;
    }
    out_.add("schema.element", meant ? Severity::error : Severity::note, subject(), child.where,
             fmt::format("<{}> in <{}> is {}{}", child.name, parent.name,
                         homes.empty() ? "not an element of a robot description" : "ignored",
                         near ? fmt::format("; did you mean <{}>?", *near) : ""),
             meant ? fmt::format("write <{}>", *near) : "");
  }

  void repeated(const XmlNode& parent, const XmlNode& child, const XmlNode& first) {
    const bool same = to_xml(child) == to_xml(first);
    const bool drawn = child.is("material");  // it only changes the picture
    out_.add("schema.repeated", same || drawn ? Severity::note : Severity::warning, subject(), child.where,
             fmt::format("<{}> has a second <{}>{}; the first is at {}", parent.name, child.name,
                         same ? ", with the same content" : " with other content", first.where.place()));
  }

  void text(const XmlNode& parent, const XmlNode& child) {
    const std::size_t begin = child.text.find_first_not_of(" \t\r\n");
    if (begin == std::string::npos) return;
    std::string shown = child.text.substr(begin, 30);
    shown = shown.substr(0, shown.find_first_of("\r\n"));
    out_.add("schema.text", subject(), child.where,
             fmt::format("the text '{}' is in <{}>, which contains no text", shown, parent.name));
  }

  Findings& out_;
  std::vector<std::string_view> path_;
  std::string subject_;
};

void check_colours(const XmlNode& node, Findings& out) {
  for (const XmlNode& child : node.children) {
    check_colours(child, out);
    const XmlAttribute* rgba = child.is("color") ? child.find("rgba") : nullptr;
    if (rgba == nullptr) continue;
    for (const std::string& word : words(rgba->value)) {
      const auto value = parse_number(word);
      if (!value || (*value >= 0 && *value <= 1)) continue;
      const XmlAttribute* name = node.find("name");
      out.add("schema.colour", name == nullptr ? "<color>" : fmt::format("material '{}'", name->value),
              rgba->where, fmt::format("rgba=\"{}\" is not within 0 .. 1", rgba->value),
              *value > 1 && *value <= 255 ? "divide the values by 255" : "");
      break;
    }
  }
}

}  // namespace

void check_schema(const AuditInput& in, Findings& out) {
  SchemaCheck(out).robot(in.expanded.root);
  check_colours(in.expanded.root, out);
}

}  // namespace doppel::audit_rules
