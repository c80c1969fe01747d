#pragma once
// XML as it was read, and as xacro expands it: compact, its names and texts views into the file's own text or
// an arena, gone all at once. XmlNode (xml.h) is the copy of it that can be edited.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/core/arena.h"
#include "doppel/core/diagnostic.h"
#include "doppel/core/source_location.h"
#include "doppel/export.h"
#include "doppel/xml/xml.h"

namespace doppel {

// What trees refer to: a file's text, and memory for what does not stand in it literally.
struct TreeSource {
  std::shared_ptr<const std::string> file;  // as the user named it
  std::string text;                         // UTF-8, without byte order mark
  Arena arena;
};

struct TreeWithin;
// A place in a file, through the calls that led there; lines and columns are counted when somebody asks.
struct DOPPEL_API TreePlace {
  const TreeSource* source = nullptr;  // null: unknown
  const TreeWithin* within = nullptr;  // null: as the element around it
  std::uint32_t offset = 0;

  [[nodiscard]] bool known() const { return source != nullptr; }
};
// "in macro 'servo_joint'", called from a place.
struct TreeWithin {
  TreePlace call;
  std::string_view what;  // "in macro"
  std::string_view name;  // "servo_joint"; may be empty
};
extern DOPPEL_API const TreeWithin kTopLevel;  // the end of the chain: what no call led to
DOPPEL_API SourceLocation locate(const TreePlace& place);
DOPPEL_API std::shared_ptr<const SourceLocation::Within> steps_of(const TreeWithin* within);

struct TreeAttribute {
  std::string_view name, value;
  TreeAttribute* next = nullptr;
  TreePlace where;      // of the name
  bool dollar = false;  // there is a '$' in the value
};

struct DOPPEL_API TreeNode {
  using Kind = XmlNode::Kind;
  Kind kind = Kind::element;
  bool cdata = false;        // a text written as <![CDATA[...]]>
  bool dollar = false;       // there is a '$' in the text
  bool blank = false;        // a text of white space only
  bool constant = false;     // as the parser read it, nothing in it is xacro's: no prefix "xacro:", no '$'
  std::uint32_t weight = 1;  // how many nodes it is with all below
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

// Nodes in order; they lie in an arena.
struct DOPPEL_API TreeList {
  TreeNode *first = nullptr, *last = nullptr;

  void push_back(TreeNode* node) {
    node->previous = last;
    node->next = nullptr;
    (last == nullptr ? first : last->next) = node;
    last = node;
  }
  // Takes all of `other`.
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

// A file as it is written: the root element, and the comments and instructions before and behind it.
struct DOPPEL_API XmlTree {
  TreeList before, after;
  const TreeNode* root = nullptr;
  XmlContent keep = XmlContent::everything;
  std::vector<std::shared_ptr<TreeSource>> sources;  // what the nodes refer to
  std::vector<Diagnostic> tolerated;                 // warnings: what XML forbids, and was read all the same
  // The first element or attribute whose prefix no xmlns declares; URDF's own readers take it, xacro does
  // not.
  std::string_view undeclared;
  TreePlace undeclared_at;

  [[nodiscard]] XmlNode node() const;  // the root, as a copy that can be edited
};

// `lenient` reads what urdfdom's parser (TinyXML) reads and XML forbids, with a warning for each: text behind
// the root, a second root, '--' in comments, a bare '&', '<' in a value, values without quotes, bytes that
// are not UTF-8. Source: TinyXML 2.6's own rules, tried with check_urdf.
enum class XmlRules { strict, lenient };

// As parse_xml and load_xml, with the same errors.
DOPPEL_API XmlTree parse_xml_tree(std::string text, const std::string& file,
                                  XmlContent keep = XmlContent::everything,
                                  XmlRules rules = XmlRules::strict);
DOPPEL_API XmlTree load_xml_tree(const std::string& file, XmlContent keep = XmlContent::everything,
                                 XmlRules rules = XmlRules::strict);

}  // namespace doppel
