#pragma once
// The edits that turn a tree into its corrected copy. Nodes are the same where they come from the same place
// of the sources through the same expansions.

#include <string>
#include <vector>

#include "doppel/base/xml/xml.h"

namespace doppel::overlay_detail {

struct TreeEdit {
  enum class Kind { set_value, add_attribute, remove_attribute, set_text, insert, remove };
  Kind kind = Kind::set_value;
  const XmlNode* node = nullptr;      // of the plain tree: whose attribute, what is removed, where to insert
  std::string attribute, from, to;    // to: the new value or text
  const XmlNode* inserted = nullptr;  // of the corrected tree
  const XmlNode* after = nullptr;     // insert behind this child of `node`; null: at its end
};

std::vector<TreeEdit> tree_edits(const XmlNode& plain, const XmlNode& corrected);

}  // namespace doppel::overlay_detail
