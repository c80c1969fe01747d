#include "doppel/description/overlay/detail/tree_edits.h"

#include <algorithm>
#include <map>

namespace doppel::overlay_detail {
namespace {

using Kind = TreeEdit::Kind;

std::string identity(const XmlNode& node) {
  return node.where.str() + ' ' + node.name + ' ' + std::to_string(static_cast<int>(node.kind));
}

class Comparison {
 public:
  explicit Comparison(std::vector<TreeEdit>& edits) : edits_(edits) {}

  void nodes(const XmlNode& plain, const XmlNode& corrected) {
    if (plain.kind == XmlNode::Kind::text) {
      if (plain.text != corrected.text)
        edits_.push_back({Kind::set_text, &plain, "", plain.text, corrected.text, nullptr, nullptr});
      return;
    }
    attributes(plain, corrected);
    children(plain, corrected);
  }

 private:
  void attributes(const XmlNode& plain, const XmlNode& corrected) {
    for (const XmlAttribute& a : plain.attributes) {
      const XmlAttribute* now = corrected.find(a.name);
      if (now == nullptr)
        edits_.push_back({Kind::remove_attribute, &plain, a.name, a.value, "", nullptr, nullptr});
      else if (now->value != a.value)
        edits_.push_back({Kind::set_value, &plain, a.name, a.value, now->value, nullptr, nullptr});
    }
    for (const XmlAttribute& a : corrected.attributes) {
      if (plain.find(a.name) == nullptr)
        edits_.push_back({Kind::add_attribute, &plain, a.name, "", a.value, nullptr, nullptr});
    }
  }

  // The k-th node from one place in the one is the k-th from it in the other.
  void children(const XmlNode& plain, const XmlNode& corrected) {
    std::map<std::string, std::vector<const XmlNode*>> from;
    for (const XmlNode& child : plain.children) from[identity(child)].push_back(&child);
    std::map<std::string, std::size_t> used;
    const XmlNode* last = nullptr;
    for (const XmlNode& child : corrected.children) {
      const std::string key = identity(child);
      const auto found = from.find(key);
      if (found == from.end() || used[key] >= found->second.size()) {
        edits_.push_back({Kind::insert, &plain, "", "", "", &child, last});
        continue;
      }
      last = found->second[used[key]++];
      nodes(*last, child);
    }
    for (const auto& [key, nodes_there] : from) {
      for (std::size_t i = used[key]; i < nodes_there.size(); ++i)
        edits_.push_back({Kind::remove, nodes_there[i], "", "", "", nullptr, nullptr});
    }
  }

  std::vector<TreeEdit>& edits_;
};

}  // namespace

std::vector<TreeEdit> tree_edits(const XmlNode& plain, const XmlNode& corrected) {
  std::vector<TreeEdit> edits;
  Comparison(edits).nodes(plain, corrected);
  return edits;
}

}  // namespace doppel::overlay_detail
