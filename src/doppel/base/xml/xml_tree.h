#pragma once
// XML as parsed, and as expanded by xacro: compact, with names and texts as views into the file's text or an
// arena, and freed at once. XmlNode (xml.h) is the editable copy.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/arena.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/source_location.h"
#include "doppel/base/xml/xml.h"
#include "doppel/export.h"

namespace doppel {

// The memory of trees: a file's text, and an arena for everything that is not literally in it.
struct TreeSource {
  std::shared_ptr<const std::string> file;  // as the user named it
  std::string text;                         // UTF-8, without byte order mark
  Arena arena;
};

struct TreeWithin;
// A place in a file, with the calls that led there; lines and columns are counted by locate().
struct DOPPEL_API TreePlace {
  const TreeSource* source = nullptr;  // nullptr: unknown
  const TreeWithin* within = nullptr;  // nullptr: that of the enclosing element
  std::uint32_t offset = 0;

  [[nodiscard]] bool known() const { return source != nullptr; }
};
// "in macro 'servo_joint'", called from a place.
struct TreeWithin {
  TreePlace call;
  std::string_view what;  // "in macro"
  std::string_view name;  // "servo_joint"; may be empty
};
extern DOPPEL_API const TreeWithin kTopLevel;  // the end of the chain: outside of any call
DOPPEL_API SourceLocation locate(const TreePlace& place);
DOPPEL_API std::shared_ptr<const SourceLocation::Within> steps_of(const TreeWithin* within);

struct TreeAttribute {
  std::string_view name, value;
  TreeAttribute* next = nullptr;
  TreePlace where;      // of the name
  bool dollar = false;  // the value has a '$'
};

struct DOPPEL_API TreeNode {
  using Kind = XmlNode::Kind;
  Kind kind = Kind::element;
  bool cdata = false;        // a text written as <![CDATA[...]]>
  bool dollar = false;       // the text has a '$'
  bool blank = false;        // a text of white space only
  bool constant = false;     // set by the parser: nothing of xacro in it, neither a prefix "xacro:" nor a '$'
  std::uint32_t weight = 1;  // the number of nodes including all descendants
  std::string_view name;     // of an element, with its prefix; of an instruction, its target
  std::string_view text;     // of everything but an element
  TreeAttribute* attributes = nullptr;
  TreeNode *first = nullptr, *last = nullptr;  // children
  TreeNode *previous = nullptr, *next = nullptr;
  TreePlace where;  // unknown for blank text

  [[nodiscard]] bool is(std::string_view element) const { return kind == Kind::element && name == element; }
  [[nodiscard]] const TreeAttribute* find(std::string_view attribute) const {
    for (const TreeAttribute* a = attributes; a != nullptr; a = a->next) {
      if (a->name == attribute) return a;
    }
    return nullptr;
  }
};

// Nodes in order; an arena owns them.
struct DOPPEL_API TreeList {
  TreeNode *first = nullptr, *last = nullptr;

  void push_back(TreeNode* node) {
    node->previous = last;
    node->next = nullptr;
    (last == nullptr ? first : last->next) = node;
    last = node;
  }
  // Moves all nodes of `other`.
  void append(TreeList other) {
    if (other.first == nullptr) return;
    other.first->previous = last;
    (last == nullptr ? first : last->next) = other.first;
    last = other.last;
  }
  void erase(TreeNode* node) {
    (node->previous == nullptr ? first : node->previous->next) = node->next;
    (node->next == nullptr ? last : node->next->previous) = node->previous;
  }
};

// A whole document: the root element, and the comments and instructions before and after it.
struct DOPPEL_API XmlTree {
  TreeList before, after;
  const TreeNode* root = nullptr;
  XmlContent keep = XmlContent::everything;
  std::vector<std::shared_ptr<TreeSource>> sources;  // the memory of the nodes
  std::vector<Diagnostic> tolerated;                 // warnings about invalid XML that was accepted
  // The first element or attribute with an undeclared prefix, which urdfdom accepts and xacro rejects.
  std::string_view undeclared;
  TreePlace undeclared_at;

  [[nodiscard]] XmlNode node() const;  // the root, as a copy that can be edited
};

// `lenient` also accepts, with a warning for each, the invalid XML that urdfdom's parser (TinyXML) accepts:
// text after the root, a second root, '--' in comments, a bare '&', '<' in a value, values without quotes,
// bytes that are not UTF-8. Source: the rules of TinyXML 2.6, verified with check_urdf.
enum class XmlRules { strict, lenient };

// These read a text or a file as parse_xml and load_xml do, with the same errors.
DOPPEL_API XmlTree parse_xml_tree(std::string text, const std::string& file,
                                  XmlContent keep = XmlContent::everything,
                                  XmlRules rules = XmlRules::strict);
DOPPEL_API XmlTree load_xml_tree(const std::string& file, XmlContent keep = XmlContent::everything,
                                 XmlRules rules = XmlRules::strict);

}  // namespace doppel
