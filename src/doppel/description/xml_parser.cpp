// From bytes to XmlNodes, in one pass without recursion.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>

#include "doppel/core/diagnostic.h"
#include "doppel/description/xml.h"
#include "doppel/description/xml_encoding.h"

namespace doppel {
namespace {

constexpr std::size_t kDeepest = 400;            // consumers of the tree recurse
constexpr std::size_t kEntityBytes = 1'000'000;  // that entities may come to
constexpr std::size_t kLargest = std::size_t{64} << 20;
constexpr int kEntityDepth = 16;
constexpr std::size_t kMostParts = 1'000'000;  // elements, attributes, texts
constexpr std::string_view kBlank = " \t\r\n";

bool blank(char c) {
  return c == ' ' || c == '\n' || c == '\t' || c == '\r';
}

bool starts_name(char c) {
  const auto u = static_cast<unsigned char>(c);
  return (u >= 'a' && u <= 'z') || (u >= 'A' && u <= 'Z') || u == '_' || u == ':' || u >= 0x80;
}
bool in_name(char c) {
  return starts_name(c) || (c >= '0' && c <= '9') || c == '-' || c == '.';
}

class Parser {
 public:
  Parser(std::string_view text, const std::string& file, XmlKeep keep)
      : text_(text), file_(std::make_shared<const std::string>(file)), keep_(keep) {}

  XmlDocument document() {
    if (text_.size() > kLargest) fail(0, "the file is larger than 64 MB");
    check_characters();
    XmlDocument out;
    open_.reserve(32);
    while (at_ < text_.size()) {
      if (open_.empty())
        outside(out);
      else if (text_[at_] == '<')
        markup();
      else
        characters();
    }
    if (!open_.empty()) unclosed(text_.size());
    if (!has_root_) fail(text_.size(), "there is no element in it");
    out.root = std::move(root_);
    return out;
  }

 private:
  [[noreturn]] void fail(std::size_t offset, const std::string& what, const std::string& mend = "") const {
    throw InputError("xml.not_well_formed", place(offset), "the XML is not well-formed: " + what,
                     mend.empty() ? "correct the XML at this place; nothing of the file was used" : mend);
  }
  [[noreturn]] void unclosed(std::size_t offset) const {
    const XmlNode& node = *open_.back();
    fail(offset,
         fmt::format("<{}>, opened at line {}, column {}, is not closed here", node.name, node.where.line,
                     node.where.column),
         fmt::format("close it with </{}> (or <{} .../>)", node.name, node.name));
  }

  // Any place, slowly; for faults.
  [[nodiscard]] SourceLocation place(std::size_t offset) const {
    offset = std::min(offset, text_.size());
    const std::string_view before = text_.substr(0, offset);
    const auto lines = static_cast<int>(std::count(before.begin(), before.end(), '\n'));
    const std::size_t start = before.rfind('\n') + 1;  // npos + 1 is 0
    return {file_, lines + 1, static_cast<int>(offset - start) + 1, nullptr};
  }
  void count_part(std::size_t offset) {
    if (++parts_ > kMostParts)
      throw InputError("xml.too_much", place(offset),
                       "there are more than a million elements and attributes");
  }
  static XmlNode& add_child(XmlNode& parent) {
    if (parent.children.capacity() == 0) parent.children.reserve(4);
    return parent.children.emplace_back();
  }
  // Places in order of reading; every part of the tree asks for its own.
  SourceLocation next_place(std::size_t offset) {
    if (++parts_ > kMostParts)
      throw InputError("xml.too_much", place(offset),
                       "there are more than a million elements and attributes");
    while (seen_ < offset) {
      const void* found = std::memchr(text_.data() + seen_, '\n', offset - seen_);
      if (found == nullptr) break;
      seen_ = static_cast<std::size_t>(static_cast<const char*>(found) - text_.data()) + 1;
      line_start_ = seen_;
      ++line_;
    }
    seen_ = std::max(seen_, offset);
    return {file_, line_, static_cast<int>(offset - line_start_) + 1, nullptr};
  }

  void check_characters() const {
    for (std::size_t i = 0; i < text_.size(); ++i) {
      // Eight at a time, as long as none is a control character or beyond ASCII.
      for (std::uint64_t eight = 0; i + 8 <= text_.size(); i += 8) {
        std::memcpy(&eight, text_.data() + i, 8);
        constexpr std::uint64_t kEach = 0x0101010101010101U;
        if ((((eight - kEach * 0x20) | eight) & (kEach * 0x80)) != 0) break;
      }
      if (i >= text_.size()) return;
      const auto c = static_cast<unsigned char>(text_[i]);
      if (c >= 0x20 && c < 0x80) continue;
      if (c < 0x20) {
        if (!blank(text_[i])) fail(i, fmt::format("the character {:#04x} is not allowed", c));
        continue;
      }
      const std::size_t length = utf8_length(text_.substr(i));
      if (length == 0)
        fail(i, fmt::format("the byte {:#04x} is not UTF-8", c),
             "save the file as UTF-8, or declare its encoding in <?xml ...?>");
      i += length - 1;
    }
  }

  [[nodiscard]] bool ahead(std::string_view what) const { return text_.substr(at_, what.size()) == what; }
  void skip_blanks() {
    while (at_ < text_.size() && blank(text_[at_])) ++at_;
  }
  std::string_view name() {
    const std::size_t begin = at_;
    if (at_ >= text_.size() || !starts_name(text_[at_])) fail(at_, "a name is expected here");
    while (at_ < text_.size() && in_name(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  // Up to `end`, which is consumed.
  std::string_view until(std::string_view end, std::size_t opened, const char* what) {
    const std::size_t found = text_.find(end, at_);
    if (found == std::string_view::npos) fail(opened, fmt::format("{} is not closed", what));
    const std::string_view out = text_.substr(at_, found - at_);
    at_ = found + end.size();
    return out;
  }

  void outside(XmlDocument& out) {
    if (blank(text_[at_])) return skip_blanks();
    if (text_[at_] != '<')
      fail(at_, has_root_ ? "there is text behind the root element" : "it begins with text");
    std::vector<XmlNode>& list = has_root_ ? out.after : out.before;
    if (ahead("<!--") || ahead("<?")) return aside(list);
    if (ahead("<!DOCTYPE") && !has_root_) return doctype();
    if (has_root_) fail(at_, "there are two root elements; it has to have one");
    if (ahead("</") || ahead("<!")) fail(at_, "it begins with what can only stand within an element");
    element();
  }

  // A comment or an instruction.
  void aside(std::vector<XmlNode>& list) {
    const std::size_t opened = at_;
    XmlNode node;
    if (ahead("<!--")) {
      at_ += 4;
      node.kind = XmlNode::Kind::comment;
      const std::size_t end = text_.find("--", at_);
      if (end == std::string_view::npos) fail(opened, "the comment is not closed");
      if (text_.substr(end, 3) != "-->")
        fail(end, "'--' stands within a comment", "comments cannot hold comments, nor '--' otherwise");
      node.text = line_ends(text_.substr(at_, end - at_));
      at_ = end + 3;
    } else {
      at_ += 2;
      node.kind = XmlNode::Kind::instruction;
      node.name = std::string(name());
      const std::string_view data = until("?>", opened, "the instruction");
      const std::size_t begin = std::min(data.find_first_not_of(kBlank), data.size());
      node.text = line_ends(data.substr(begin));
      if (node.name == "xml") {
        if (opened != 0) fail(opened, "<?xml ...?> stands somewhere else than at the very beginning");
        return;
      }
    }
    if (keep_ == XmlKeep::content) return;
    node.where = next_place(opened);
    list.push_back(std::move(node));
  }

  // Only the entities of an internal subset matter here.
  void doctype() {
    const std::size_t opened = at_;
    at_ += 9;
    while (at_ < text_.size() && text_[at_] != '[' && text_[at_] != '>') {
      const char c = text_[at_++];
      if (c == '"' || c == '\'') until(std::string_view(&c, 1), opened, "the DOCTYPE");
    }
    if (at_ < text_.size() && text_[at_] == '[') {
      ++at_;
      while (true) {
        skip_blanks();
        if (at_ >= text_.size()) fail(opened, "the DOCTYPE is not closed");
        if (text_[at_] == ']') break;
        declaration();
      }
      ++at_;
      skip_blanks();
    }
    if (at_ >= text_.size() || text_[at_] != '>') fail(opened, "the DOCTYPE is not closed");
    ++at_;
  }
  void declaration() {
    const std::size_t opened = at_;
    if (ahead("<!--")) {
      at_ += 4;
      until("-->", opened, "the comment");
    } else if (ahead("<?")) {
      until("?>", opened, "the instruction");
    } else if (ahead("<!ENTITY")) {
      at_ += 8;
      entity(opened);
    } else if (ahead("<!")) {
      quoted_until_close(opened);
    } else {
      fail(at_, "a declaration is expected in the DOCTYPE");
    }
  }
  void quoted_until_close(std::size_t opened) {
    while (at_ < text_.size() && text_[at_] != '>') {
      const char c = text_[at_++];
      if (c == '"' || c == '\'') until(std::string_view(&c, 1), opened, "the declaration");
    }
    if (at_ >= text_.size()) fail(opened, "the declaration is not closed");
    ++at_;
  }
  void entity(std::size_t opened) {
    skip_blanks();
    if (at_ < text_.size() && text_[at_] == '%') return quoted_until_close(opened);
    const std::string key(name());
    skip_blanks();
    if (at_ < text_.size() && (text_[at_] == '"' || text_[at_] == '\'')) {
      const char quote = text_[at_++];
      entities_.emplace(key, until(std::string_view(&quote, 1), opened, "the entity"));
    }
    quoted_until_close(opened);
  }

  void markup() {
    if (ahead("<!--") || ahead("<?")) return aside(open_.back()->children);
    if (ahead("<![CDATA[")) return section();
    if (ahead("</")) return close();
    if (ahead("<!")) fail(at_, "a declaration cannot stand within an element");
    element();
  }

  void section() {
    const std::size_t opened = at_;
    at_ += 9;
    XmlNode node;
    node.kind = XmlNode::Kind::text;
    node.cdata = true;
    node.text = line_ends(until("]]>", opened, "the CDATA section"));
    node.where = next_place(opened);
    open_.back()->children.push_back(std::move(node));
  }

  void close() {
    const std::size_t opened = at_;
    at_ += 2;
    const std::string_view closing = name();
    if (closing != open_.back()->name) unclosed(opened);
    skip_blanks();
    if (at_ >= text_.size() || text_[at_] != '>') fail(at_, fmt::format("</{}> has no '>'", closing));
    ++at_;
    tidy(*open_.back());
    open_.pop_back();
  }

  // Blank text beside elements says nothing where only the content matters.
  void tidy(XmlNode& node) const {
    if (keep_ == XmlKeep::everything || node.children.size() < 2) return;
    std::erase_if(node.children, [](const XmlNode& child) {
      return child.kind == XmlNode::Kind::text && !child.cdata &&
             child.text.find_first_not_of(kBlank) == std::string::npos;
    });
  }

  void element() {
    const std::size_t opened = at_++;
    if (open_.size() >= kDeepest)
      throw InputError("xml.too_deep", place(opened),
                       fmt::format("elements are nested more than {} deep", kDeepest));
    XmlNode* node = &root_;
    if (!open_.empty()) node = &add_child(*open_.back());
    has_root_ = true;
    node->name = std::string(name());
    node->where = next_place(opened);
    while (true) {
      const std::size_t before = at_;
      skip_blanks();
      if (at_ >= text_.size()) fail(opened, fmt::format("<{}> has no '>'", node->name));
      if (text_[at_] == '>') {
        ++at_;
        open_.push_back(node);
        return;
      }
      if (ahead("/>")) {
        at_ += 2;
        return;
      }
      if (before == at_) fail(at_, fmt::format("'{}' was not expected in <{}>", text_[at_], node->name));
      attribute(*node);
    }
  }

  void attribute(XmlNode& node) {
    const std::size_t begin = at_;
    const std::string_view key = name();
    skip_blanks();
    if (at_ >= text_.size() || text_[at_] != '=')
      fail(at_, fmt::format("the attribute {} has no value", key));
    ++at_;
    skip_blanks();
    if (at_ >= text_.size() || (text_[at_] != '"' && text_[at_] != '\''))
      fail(at_, fmt::format("the value of {} needs quotes", key));
    const char quote = text_[at_++];
    const std::size_t value = at_;
    std::size_t end = at_;
    bool plain = true;
    for (; end < text_.size() && text_[end] != quote; ++end) {
      const char c = text_[end];
      if (c == '<')
        fail(end, fmt::format("'<' stands in the value of {}", key), "write &lt;, or close the quotes");
      plain = plain && c != '&' && c >= ' ';
    }
    if (end >= text_.size()) fail(begin, fmt::format("the value of {} has no closing quote", key));
    if (node.find(key) != nullptr) fail(begin, fmt::format("the attribute {} is given twice", key));
    at_ = end + 1;
    XmlAttribute& made = node.attributes.emplace_back();
    made.name = std::string(key);
    const std::string_view raw = text_.substr(value, end - value);
    made.value = plain || raw.find_first_of("&\t\r\n") == std::string_view::npos ? std::string(raw)
                                                                                 : attribute_text(raw, value);
    made.where = next_place(begin);
  }

  std::string attribute_text(std::string_view raw, std::size_t offset) {
    std::string out;
    for (std::size_t i = 0; i < raw.size(); ++i) {
      if (raw[i] == '&') {
        i += reference(raw.substr(i), offset + i, true, 0, out) - 1;
      } else if (raw[i] == '\r' && i + 1 < raw.size() && raw[i + 1] == '\n') {
        continue;
      } else {
        out += blank(raw[i]) ? ' ' : raw[i];
      }
    }
    return out;
  }

  void characters() {
    const std::size_t begin = at_;
    bool all_blank = true, plain = true;
    for (; at_ < text_.size() && text_[at_] != '<'; ++at_) {
      const char c = text_[at_];
      all_blank = all_blank && blank(c);
      plain = plain && c != '&' && c != '\r' && c != ']';
    }
    const std::string_view raw = text_.substr(begin, at_ - begin);
    if (const std::size_t bad = plain ? std::string_view::npos : raw.find("]]>");
        bad != std::string_view::npos)
      fail(begin + bad, "']]>' stands in a text");
    XmlNode& parent = *open_.back();
    if (keep_ == XmlKeep::content && all_blank && (!parent.children.empty() || !ahead("</"))) return;
    XmlNode& node = add_child(parent);
    node.kind = XmlNode::Kind::text;
    if (all_blank)
      count_part(begin);  // nothing is ever said about its place
    else
      node.where = next_place(begin);
    if (plain) {
      node.text = std::string(raw);
      return;
    }
    for (std::size_t i = 0; i < raw.size(); ++i) {
      if (raw[i] == '&')
        i += reference(raw.substr(i), begin + i, false, 0, node.text) - 1;
      else if (raw[i] == '\r')
        node.text += i + 1 < raw.size() && raw[i + 1] == '\n' ? "" : "\n";
      else
        node.text += raw[i];
    }
  }

  static std::string line_ends(std::string_view raw) {
    std::string out(raw);
    if (raw.find('\r') == std::string_view::npos) return out;
    out.clear();
    for (std::size_t i = 0; i < raw.size(); ++i) {
      if (raw[i] != '\r')
        out += raw[i];
      else if (i + 1 >= raw.size() || raw[i + 1] != '\n')
        out += '\n';
    }
    return out;
  }

  // Appends what the reference at the beginning of `raw` stands for; how many bytes it takes.
  std::size_t reference(std::string_view raw, std::size_t offset, bool attribute, int depth,
                        std::string& out) {
    const std::size_t end = raw.substr(0, 256).find(';');
    if (end == std::string_view::npos || end < 2)
      fail(offset, "'&' does not begin a reference", "write &amp; for the character itself");
    const std::string_view key = raw.substr(1, end - 1);
    static constexpr std::pair<std::string_view, char> kKnown[] = {
        {"lt", '<'}, {"gt", '>'}, {"amp", '&'}, {"quot", '"'}, {"apos", '\''}};
    for (const auto& [known, character] : kKnown) {
      if (key == known) return out += character, end + 1;
    }
    if (key[0] == '#') {
      const char32_t code = character_reference(key.substr(1));
      if (code == 0) fail(offset, fmt::format("&{}; is no character", key));
      append_utf8(out, code);
      return end + 1;
    }
    const auto found = entities_.find(key);
    if (found == entities_.end())
      fail(offset, fmt::format("the entity &{}; is not defined", key), "write &amp; for the character '&'");
    if (depth >= kEntityDepth) fail(offset, "entities are nested too deeply");
    insert_entity(found->second, offset, attribute, depth + 1, out);
    return end + 1;
  }
  void insert_entity(std::string_view value, std::size_t offset, bool attribute, int depth,
                     std::string& out) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (++entity_bytes_ > kEntityBytes) fail(offset, "its entities come to more than 1 MB");
      if (value[i] == '<') fail(offset, "entities that hold elements are not supported");
      if (value[i] == '&')
        i += reference(value.substr(i), offset, attribute, depth, out) - 1;
      else
        out += attribute && blank(value[i]) ? ' ' : value[i];
    }
  }

  std::string_view text_;
  std::shared_ptr<const std::string> file_;
  XmlKeep keep_;
  std::size_t at_ = 0;
  std::size_t seen_ = 0, line_start_ = 0;  // for next_place
  int line_ = 1;
  std::size_t parts_ = 0;
  XmlNode root_;
  bool has_root_ = false;
  std::vector<XmlNode*> open_;  // an element's place is fixed until it closes: only the innermost grows
  std::map<std::string, std::string, std::less<>> entities_;
  std::size_t entity_bytes_ = 0;
};

}  // namespace

XmlDocument parse_xml_document(std::string_view text, const std::string& file, XmlKeep keep) {
  std::string converted;
  try {
    return Parser(as_utf8(text, converted), file, keep).document();
  } catch (const UnknownEncoding& problem) {
    throw InputError("xml.not_well_formed", make_location(file, 1, 1),
                     fmt::format("the encoding '{}' is not supported", problem.what()),
                     "save the file as UTF-8");
  }
}

}  // namespace doppel
