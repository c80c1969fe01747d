#pragma once
// XML with places: every element, attribute and text knows its file, line and column. Small on purpose: what
// xacro copies, and what the URDF parser reads.

#include <string>
#include <string_view>
#include <vector>

#include "doppel/core/source_location.h"

namespace doppel {

struct XmlAttribute {
  std::string name, value;
  SourceLocation where;  // of the name
};

struct XmlNode {
  enum class Kind { element, text };
  Kind kind = Kind::element;
  std::string name;  // of an element, with its prefix
  std::string text;  // of a text
  std::vector<XmlAttribute> attributes;
  std::vector<XmlNode> children;
  SourceLocation where;

  [[nodiscard]] bool is(std::string_view element) const { return kind == Kind::element && name == element; }
  [[nodiscard]] const XmlAttribute* find(std::string_view attribute) const;
  [[nodiscard]] const XmlNode* first(std::string_view element) const;
  [[nodiscard]] std::string content() const;  // the texts directly below, trimmed
};

// Comments and processing instructions are left out. Throws InputError "xml.not_well_formed" with the place.
XmlNode parse_xml(const std::string& text, const std::string& file);

// Reads the file first; throws InputError "file.unreadable".
XmlNode load_xml(const std::string& file);

std::string to_xml(const XmlNode& node);

}  // namespace doppel
