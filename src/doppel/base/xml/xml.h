#pragma once
// XML with places: every element, attribute and text has its file, line and column. This is the editable
// form; xml_tree.h has the compact form in which files are parsed and expanded. Source: Extensible Markup
// Language 1.0, fifth edition.

#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/export.h"

namespace doppel {

struct XmlAttribute {
  std::string name, value;
  SourceLocation where;  // of the name
};

struct DOPPEL_API XmlNode {
  enum class Kind { element, text, comment, instruction };
  Kind kind = Kind::element;
  bool cdata = false;  // a text written as <![CDATA[...]]>
  std::string name;    // of an element, with its prefix; of an instruction, its target
  std::string text;    // of everything but an element
  std::vector<XmlAttribute> attributes;
  std::vector<XmlNode> children;
  SourceLocation where;

  [[nodiscard]] bool is(std::string_view element) const { return kind == Kind::element && name == element; }
  [[nodiscard]] const XmlAttribute* find(std::string_view attribute) const;
  [[nodiscard]] const XmlNode* first(std::string_view element) const;
  [[nodiscard]] std::string content() const;  // the texts directly below, trimmed
};

// `content` omits comments, processing instructions, and blank text next to elements; `everything` keeps
// them. Blanks and comments before <?xml are skipped. One root element; names, references, nesting and
// characters are checked, entities of an internal DTD are replaced, no other file is read. Bounded: 64 MB,
// 400 levels, 1 MB of entities. UTF-8, UTF-16 with a byte order mark, Latin-1. Throws InputError
// "xml.not_well_formed" with the place.
enum class XmlContent { content, everything };
DOPPEL_API XmlNode parse_xml(std::string_view text, const std::string& file,
                             XmlContent keep = XmlContent::content);

// Reads the file first; throws also InputError "file.unreadable" if it is not a regular file or too large.
DOPPEL_API XmlNode load_xml(const std::string& file);
// The bytes of a regular file of at most `largest` bytes. Throws InputError "file.unreadable".
DOPPEL_API std::string read_file(const std::string& file, std::size_t largest);

DOPPEL_API std::string to_xml(const XmlNode& node);
DOPPEL_API std::string escape_xml(std::string_view text, bool quotes);
DOPPEL_API void append_escaped(std::string& out, std::string_view text, bool quotes);

}  // namespace doppel
