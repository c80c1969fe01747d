#pragma once
// A message in a text form as the parsers of YAML and JSON leave it for the one reader that has the rules.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/type_description.h"

namespace doppel::messages_detail {

enum class TextKind : std::uint8_t { nothing, scalar, list, map, alias };

struct TextPlace {  // from 1
  std::size_t line = 1;
  std::size_t column = 1;
};

struct TextNode {
  TextKind kind = TextKind::nothing;
  bool quoted = false;  // a scalar in quotation marks
  TextPlace place;
  std::size_t after = 0;  // index of the node behind this one and its children
  std::size_t size = 0;   // children of a list or map (two for each entry), bytes of a scalar
  std::size_t begin = 0;  // of a scalar's text among all texts; index of the node that an alias stands for
};

// Nodes in the order of the text, each before its children, so that neither building nor destroying a deep
// tree uses the stack.
class TextTree {
 public:
  void add(TextNode node) {
    if (!open_.empty()) ++nodes_[open_.back()].size;
    node.after = nodes_.size() + 1;
    nodes_.push_back(node);
  }
  void add_scalar(std::string_view text, bool quoted, TextPlace place) {
    add({.kind = TextKind::scalar,
         .quoted = quoted,
         .place = place,
         .size = text.size(),
         .begin = texts_.size()});
    texts_ += text;
  }
  void open(TextKind kind, TextPlace place) {
    add({.kind = kind, .place = place});
    open_.push_back(nodes_.size() - 1);
  }
  void close() {
    nodes_[open_.back()].after = nodes_.size();
    open_.pop_back();
  }

  [[nodiscard]] std::size_t size() const { return nodes_.size(); }
  [[nodiscard]] const TextNode& node(std::size_t index) const {
    const TextNode& found = nodes_[index];
    return found.kind == TextKind::alias ? nodes_[found.begin] : found;
  }
  [[nodiscard]] std::string_view text(const TextNode& scalar) const {
    return std::string_view(texts_).substr(scalar.begin, scalar.size);
  }
  [[nodiscard]] std::size_t first_child(const TextNode& node) const {
    return static_cast<std::size_t>(&node - nodes_.data()) + 1;
  }
  [[nodiscard]] std::size_t after(std::size_t index) const { return nodes_[index].after; }

 private:
  std::vector<TextNode> nodes_;
  std::vector<std::size_t> open_;
  std::string texts_;
};

// Without a node: the message with its initial values.
Status tree_to_cdr(const TypeDescription& type, const TextTree& tree, Bytes& out);

}  // namespace doppel::messages_detail
