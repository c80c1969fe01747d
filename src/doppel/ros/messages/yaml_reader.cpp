// From YAML as in `ros2 topic pub` to CDR.

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <sstream>

#include "doppel/ros/messages/detail/text_tree.h"

namespace doppel {
namespace {

using messages_detail::TextKind;
using messages_detail::TextPlace;
using messages_detail::TextTree;

class YamlEvents : public YAML::EventHandler {
 public:
  explicit YamlEvents(TextTree& tree) : tree_(tree) {}

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    remember(anchor);
    tree_.add({.place = place_of(mark)});
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    tree_.add({.kind = TextKind::alias, .place = place_of(mark), .begin = anchors_.at(anchor - 1)});
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    remember(anchor);
    tree_.add_scalar(value, tag == "!", place_of(mark));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    remember(anchor);
    tree_.open(TextKind::list, place_of(mark));
  }
  void OnSequenceEnd() override { tree_.close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    remember(anchor);
    tree_.open(TextKind::map, place_of(mark));
  }
  void OnMapEnd() override { tree_.close(); }

 private:
  static TextPlace place_of(const YAML::Mark& mark) {
    return {.line = static_cast<std::size_t>(mark.line) + 1,
            .column = static_cast<std::size_t>(mark.column) + 1};
  }
  // The parser numbers the anchors from 1 in their order.
  void remember(YAML::anchor_t anchor) {
    if (anchor != YAML::NullAnchor) anchors_.push_back(tree_.size());
  }

  TextTree& tree_;
  std::vector<std::size_t> anchors_;
};

// The line on which a second document begins; 0: there is none. YAML::LoadAll does not terminate for
// some invalid texts.
int second_document(std::string_view yaml) {
  bool content = false;
  int line = 0;
  while (!yaml.empty()) {
    const std::string_view text = yaml.substr(0, yaml.find('\n'));
    yaml.remove_prefix(std::min(text.size() + 1, yaml.size()));
    ++line;
    const bool separates = text.starts_with("---") && (text.size() == 3 || text[3] == ' ' || text[3] == '\r');
    if (separates && content) return line;
    const std::size_t first = text.find_first_not_of(" \t\r");
    content =
        content || separates || (first != std::string_view::npos && text[first] != '#' && text[first] != '%');
  }
  return 0;
}

}  // namespace

Status yaml_to_cdr(const TypeDescription& type, std::string_view yaml, Bytes& out) {
  if (const int line = second_document(yaml); line > 0)
    return Status::refused(fmt::format("{}:1: expected one message, not several YAML documents", line));
  TextTree tree;
  try {
    std::istringstream text{std::string(yaml)};
    YamlEvents events(tree);
    YAML::Parser(text).HandleNextDocument(events);
  } catch (const YAML::Exception& e) {
    return Status::refused(fmt::format("{}:{}: not YAML: {}", e.mark.line + 1, e.mark.column + 1, e.msg));
  }
  return messages_detail::tree_to_cdr(type, tree, out);
}

}  // namespace doppel
