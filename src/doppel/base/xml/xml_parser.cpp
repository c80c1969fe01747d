// From bytes to a tree, in one pass without recursion.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/utf8.h"
#include "doppel/base/xml/detail/xml_characters.h"
#include "doppel/base/xml/detail/xml_encoding.h"
#include "doppel/base/xml/xml_tree.h"

namespace doppel {
namespace {

using namespace xml_characters;

constexpr std::size_t kMaxDepth = 400;           // consumers of the tree recurse
constexpr std::size_t kEntityBytes = 1'000'000;  // limit of expanded entities
constexpr std::size_t kMaxBytes = std::size_t{64} << 20;
constexpr int kEntityDepth = 16;
constexpr std::size_t kMaxParts = 1'000'000;  // elements, attributes, texts
constexpr std::string_view kBlank = " \t\r\n";

class Parser {
 public:
  Parser(std::shared_ptr<TreeSource> source, XmlContent keep, XmlRules rules)
      : source_(std::move(source)),
        arena_(source_->arena),
        text_(source_->text),
        keep_(keep),
        lenient_(rules == XmlRules::lenient) {}

  // What the bytes were changed into before they came here.
  void changed(std::size_t offset) {
    if (offset != std::string::npos) tolerate(offset, "the file contains bytes that are not UTF-8");
  }

  XmlTree document() {
    if (text_.size() > kMaxBytes) fail(0, "the file is larger than 64 MB");
    check_characters();
    XmlTree out;
    out.keep = keep_;
    while (at_ < text_.size()) {
      if (open_.empty())
        outside(out);
      else if (text_[at_] == '<')
        markup();
      else
        characters();
    }
    if (!open_.empty()) unclosed(text_.size());
    if (root_ == nullptr) fail(text_.size(), "the file contains no element");
    out.root = root_;
    out.tolerated = std::move(tolerated_);
    out.undeclared = undeclared_;
    out.undeclared_at = undeclared_at_;
    out.sources.push_back(std::move(source_));
    return out;
  }

 private:
  [[noreturn]] void fail(std::size_t offset, const std::string& what, const std::string& fix = "") const {
    throw InputError("xml.not_well_formed", locate(place(offset)), "the XML is not well-formed: " + what,
                     fix.empty() ? "correct the XML at this place; nothing of the file was used" : fix);
  }
  // Invalid XML that urdfdom accepts: rejected, or a warning with lenient rules.
  void tolerate(std::size_t offset, const std::string& what, const std::string& fix = "") {
    if (!lenient_) fail(offset, what, fix);
    warn(offset, what + "; urdfdom accepts it, but xacro and other XML parsers reject the file", fix);
  }
  void warn(std::size_t offset, const std::string& what, const std::string& fix) {
    constexpr std::size_t kMaxWarnings = 20;
    if (tolerated_.size() < kMaxWarnings)
      tolerated_.push_back({Severity::warning, "xml.tolerated", "the XML is not well-formed: " + what,
                            locate(place(offset)), fix.empty() ? "correct the XML at this place" : fix});
  }
  [[noreturn]] void unclosed(std::size_t offset) const {
    const TreeNode& node = *open_.back();
    const SourceLocation opened = locate(node.where);
    fail(offset,
         fmt::format("<{}>, opened at line {}, column {}, is not closed here", node.name, opened.line,
                     opened.column),
         fmt::format("close it with </{}> (or <{} .../>)", node.name, node.name));
  }

  [[nodiscard]] TreePlace place(std::size_t offset) const {
    return {source_.get(), nullptr, static_cast<std::uint32_t>(std::min(offset, text_.size()))};
  }
  void count_part(std::size_t offset) {
    if (++parts_ > kMaxParts)
      throw InputError("xml.too_much", locate(place(offset)),
                       "there are more than a million elements and attributes");
  }
  static void add(TreeNode& parent, TreeNode* node) {
    node->previous = parent.last;
    (parent.last == nullptr ? parent.first : parent.last->next) = node;
    parent.last = node;
  }
  TreeNode* make(TreeNode::Kind kind, std::size_t offset) {
    count_part(offset);
    auto* const out = arena_.make<TreeNode>();
    out->kind = kind;
    out->where = place(offset);
    return out;
  }

  void check_characters() const {
    constexpr std::size_t kBlock = 64;
    for (std::size_t i = 0; i < text_.size();) {
      if (i + kBlock <= text_.size() && ordinary(text_.data() + i, kBlock)) {
        i += kBlock;
        continue;
      }
      const std::size_t end = std::min(i + kBlock, text_.size());
      while (i < end) i += check_character(i);
    }
  }
  // Its length.
  [[nodiscard]] std::size_t check_character(std::size_t at) const {
    const auto c = static_cast<unsigned char>(text_[at]);
    if (c < 0x20 && !blank(text_[at])) fail(at, fmt::format("the character {:#04x} is not allowed", c));
    const std::size_t length = utf8_length(text_.substr(at));
    if (length == 0)
      fail(at, fmt::format("the byte {:#04x} is not UTF-8", c),
           "save the file as UTF-8, or declare its encoding in <?xml ...?>");
    return length;
  }

  [[nodiscard]] bool ahead(std::string_view what) const { return text_.substr(at_, what.size()) == what; }
  // The first character from `at` on that is not of that kind.
  [[nodiscard]] std::size_t end_of(Class what, std::size_t at) const {
    const char* next = text_.data() + at;
    while (is(*next, what)) ++next;
    return static_cast<std::size_t>(next - text_.data());
  }
  [[nodiscard]] std::size_t next_of(Class what, std::size_t at) const {
    const char* next = text_.data() + at;
    while (!is(*next, what)) ++next;
    return static_cast<std::size_t>(next - text_.data());
  }
  void skip_blanks() {
    while (at_ < text_.size() && blank(text_[at_])) ++at_;
  }
  std::string_view name() {
    const std::size_t begin = at_;
    if (at_ >= text_.size() || !is(text_[at_], kStartsName)) fail(at_, "a name is expected here");
    at_ = end_of(kInName, at_);
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

  void outside(XmlTree& out) {
    if (blank(text_[at_])) return skip_blanks();
    if (text_[at_] != '<') {
      if (root_ == nullptr) fail(at_, "it begins with text");
      tolerate(at_, "there is text after the root element");
      at_ = std::min(text_.find('<', at_), text_.size());
      return;
    }
    if (ahead("<!--") || ahead("<?")) {
      if (TreeNode* const node = aside()) (root_ != nullptr ? out.after : out.before).push_back(node);
      return;
    }
    if (ahead("<!DOCTYPE") && root_ == nullptr) return doctype();
    if (ahead("</") || ahead("<!"))
      fail(at_, "it begins with content that is only allowed inside an element");
    if (root_ != nullptr) tolerate(at_, "there are two root elements, but only one is allowed");
    element();
  }

  // A comment or an instruction; null: it is not kept.
  TreeNode* aside() {
    const std::size_t opened = at_;
    const bool comment = ahead("<!--");
    std::string_view name, text;
    if (comment) {
      at_ += 4;
      std::size_t end = text_.find("--", at_);
      if (end == std::string_view::npos) fail(opened, "the comment is not closed");
      if (text_.substr(end, 3) != "-->") {
        tolerate(end, "'--' is not allowed in a comment", "comments cannot contain comments or '--'");
        end = text_.find("-->", end);
        if (end == std::string_view::npos) fail(opened, "the comment is not closed");
      }
      text = text_.substr(at_, end - at_);
      at_ = end + 3;
    } else {
      at_ += 2;
      name = this->name();
      const std::string_view data = until("?>", opened, "the instruction");
      text = data.substr(std::min(data.find_first_not_of(kBlank), data.size()));
      if (name == "xml") {
        if (opened != 0) late_declaration(opened);
        declared_ = true;
        return nullptr;
      }
    }
    if (keep_ == XmlContent::content) return nullptr;
    TreeNode* const node = make(comment ? TreeNode::Kind::comment : TreeNode::Kind::instruction, opened);
    node->name = name;
    node->text = with_line_ends(text);
    node->dollar = node->text.find('$') != std::string_view::npos;
    node->constant = !comment || node->text.find("xacro:") == std::string_view::npos;
    return node;
  }

  // Behind blank lines and comments, as editors write them, it does no harm.
  void late_declaration(std::size_t at) {
    const std::string what = "<?xml ...?> is not at the beginning of the file";
    if (declared_ || root_ != nullptr) return tolerate(at, what);
    warn(at, what + "; urdfdom accepts it, but ros/xacro rejects the file", "remove everything before it");
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
    const char next = at_ + 1 < text_.size() ? text_[at_ + 1] : '\0';
    if (next == '/') return close();
    if (next != '!' && next != '?') return element();
    if (next == '?' || ahead("<!--")) {
      if (TreeNode* const node = aside()) add(*open_.back(), node);
      return;
    }
    if (ahead("<![CDATA[")) return section();
    tolerate(at_, "a declaration is not allowed inside an element");
    until(">", at_, "the declaration");
  }

  void section() {
    const std::size_t opened = at_;
    at_ += 9;
    const std::string_view raw = until("]]>", opened, "the CDATA section");
    TreeNode* const node = make(TreeNode::Kind::text, opened);
    node->cdata = true;
    node->constant = true;
    node->text = with_line_ends(raw);
    add(*open_.back(), node);
  }

  void close() {
    const std::size_t opened = at_;
    at_ += 2;
    const std::string_view closing = name();
    TreeNode& node = *open_.back();
    if (closing != node.name) unclosed(opened);
    skip_blanks();
    if (at_ >= text_.size() || text_[at_] != '>') fail(at_, fmt::format("</{}> has no '>'", closing));
    ++at_;
    open_.pop_back();
    if (decoded_blank_) tidy(node);
    for (const TreeNode* child = node.first; child != nullptr; child = child->next) {
      node.weight += child->weight;
      node.constant = node.constant && child->constant;
    }
  }

  // Blank text next to elements has no meaning where only the content matters; literally blank text was not
  // created at all.
  void tidy(TreeNode& node) const {
    if (keep_ == XmlContent::everything || node.first == node.last) return;
    TreeList children{node.first, node.last};
    for (TreeNode *child = node.first, *next = nullptr; child != nullptr; child = next) {
      next = child->next;
      if (child->kind == TreeNode::Kind::text && !child->cdata &&
          child->text.find_first_not_of(kBlank) == std::string_view::npos)
        children.erase(child);
    }
    node.first = children.first;
    node.last = children.last;
  }

  void element() {
    const std::size_t opened = at_++;
    if (open_.size() >= kMaxDepth)
      throw InputError("xml.too_deep", locate(place(opened)),
                       fmt::format("elements are nested more than {} deep", kMaxDepth));
    TreeNode* const node = make(TreeNode::Kind::element, opened);
    node->name = name();
    node->constant = !node->name.starts_with("xacro:");
    if (!open_.empty())
      add(*open_.back(), node);
    else if (root_ == nullptr || (root_->name != "robot" && node->name == "robot"))
      root_ = node;
    TreeAttribute** end = &node->attributes;
    while (true) {
      const std::size_t before = at_;
      skip_blanks();
      if (at_ >= text_.size()) fail(opened, fmt::format("<{}> has no '>'", node->name));
      if (text_[at_] == '>') {
        ++at_;
        check_prefixes(*node);
        open_.push_back(node);
        return;
      }
      if (ahead("/>")) {
        at_ += 2;
        check_prefixes(*node);
        return;
      }
      if (before == at_) {
        const std::string what = fmt::format("unexpected '{}' in <{}>", text_[at_], node->name);
        if (!is(text_[at_], kStartsName)) fail(at_, what);
        tolerate(at_, what, "write a space before it");
      }
      TreeAttribute* const made = attribute(*node);
      *end = made;
      end = &made->next;
      const std::string_view key = made->name;
      if (made->dollar || (key[0] == 'x' && (key.starts_with("xacro:") || key == "xmlns:xacro")))
        node->constant = false;
    }
  }

  // Prefixes other than xml's need a declaration in an enclosing element; the first without one is kept.
  void check_prefixes(const TreeNode& node) {
    check_prefix(node, node.name, node.where);
    for (const TreeAttribute* a = node.attributes; a != nullptr; a = a->next)
      check_prefix(node, a->name, a->where);
  }
  void check_prefix(const TreeNode& node, std::string_view name, const TreePlace& where) {
    const std::size_t colon = name.find(':');
    if (colon == std::string_view::npos || colon == 0 || !undeclared_.empty()) return;
    const std::string_view prefix = name.substr(0, colon);
    if (prefix == "xmlns" || prefix == "xml" || prefix == known_prefix_) return;
    const auto declares = [prefix](const TreeNode& at) {
      for (const TreeAttribute* a = at.attributes; a != nullptr; a = a->next) {
        if (a->name.starts_with("xmlns:") && a->name.substr(6) == prefix) return true;
      }
      return false;
    };
    if (root_ != nullptr && declares(*root_)) {
      known_prefix_ = prefix;
      return;
    }
    if (declares(node) ||
        std::any_of(open_.begin(), open_.end(), [&](const TreeNode* n) { return declares(*n); }))
      return;
    undeclared_ = prefix;
    undeclared_at_ = where;
  }

  TreeAttribute* attribute(const TreeNode& node) {
    const std::size_t begin = at_;
    const std::string_view key = name();
    skip_blanks();
    if (at_ >= text_.size() || text_[at_] != '=')
      fail(at_, fmt::format("the attribute {} has no value", key));
    ++at_;
    skip_blanks();
    if (at_ >= text_.size() || (text_[at_] != '"' && text_[at_] != '\'')) return bare_value(begin, key);
    const char quote = text_[at_++];
    const std::size_t value = at_;
    std::size_t end = at_;
    bool plain = true, dollar = false;
    for (;; ++end) {
      end = next_of(kNotableInValue, end);
      if (end >= text_.size()) break;
      const char c = text_[end];
      if (c == quote) break;
      if (c == '<')
        tolerate(end, fmt::format("'<' is not allowed in the value of {}", key),
                 "write &lt;, or close the quotes");
      plain = plain && c != '&' && c >= ' ';
      dollar = dollar || c == '$';
    }
    if (end >= text_.size()) fail(begin, fmt::format("the value of {} has no closing quote", key));
    if (node.find(key) != nullptr) fail(begin, fmt::format("the attribute {} is given twice", key));
    at_ = end + 1;
    count_part(begin);
    auto* const made = arena_.make<TreeAttribute>();
    made->name = key;
    made->value = text_.substr(value, end - value);
    made->where = place(begin);
    made->dollar = dollar;
    if (!plain) {
      made->value = attribute_text(made->value, value);
      made->dollar = made->value.find('$') != std::string_view::npos;
    }
    return made;
  }

  // Up to a blank or the end of the element.
  TreeAttribute* bare_value(std::size_t begin, std::string_view key) {
    tolerate(at_, fmt::format("the value of {} needs quotes", key), "write quotes around it");
    const std::size_t value = at_;
    at_ = std::min(text_.find_first_of(" \t\r\n/>\"'<", at_), text_.size());
    if (at_ == value) fail(begin, fmt::format("the attribute {} has no value", key));
    count_part(begin);
    auto* const made = arena_.make<TreeAttribute>();
    made->name = key;
    made->value = attribute_text(text_.substr(value, at_ - value), value);
    made->where = place(begin);
    made->dollar = made->value.find('$') != std::string_view::npos;
    return made;
  }

  std::string_view attribute_text(std::string_view raw, std::size_t offset) {
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
    return arena_.copy(out);
  }

  void characters() {
    const std::size_t begin = at_;
    at_ = end_of(kBlankInText, at_);
    bool all_blank = at_ >= text_.size() || text_[at_] == '<';
    bool plain = true, dollar = false;
    for (;; ++at_) {
      at_ = next_of(kNotableInText, at_);
      if (at_ >= text_.size() || text_[at_] == '<') break;
      const char c = text_[at_];
      plain = plain && c == '$';
      dollar = dollar || c == '$';
    }
    const std::string_view raw = text_.substr(begin, at_ - begin);
    if (!plain) {
      all_blank = raw.find_first_not_of(kBlank) == std::string_view::npos;
      if (const std::size_t bad = raw.find("]]>"); bad != std::string_view::npos)
        tolerate(begin + bad, "']]>' is not allowed in text");
    }
    TreeNode& parent = *open_.back();
    if (keep_ == XmlContent::content && all_blank && (parent.first != nullptr || !ahead("</"))) return;
    TreeNode* const node = make(TreeNode::Kind::text, begin);
    add(parent, node);
    node->text = plain ? raw : decoded(raw, begin);
    node->dollar = plain ? dollar : node->text.find('$') != std::string_view::npos;
    node->constant = !node->dollar;
    node->blank = all_blank;
    if (all_blank) node->where = {};  // no diagnostic refers to its place
    if (!plain && !all_blank) {
      node->blank = !node->text.empty() && node->text.find_first_not_of(kBlank) == std::string_view::npos;
      decoded_blank_ = decoded_blank_ || node->blank || node->text.empty();
    }
  }

  std::string_view decoded(std::string_view raw, std::size_t offset) {
    std::string out;
    for (std::size_t i = 0; i < raw.size(); ++i) {
      if (raw[i] == '&')
        i += reference(raw.substr(i), offset + i, false, 0, out) - 1;
      else if (raw[i] == '\r')
        out += i + 1 < raw.size() && raw[i + 1] == '\n' ? "" : "\n";
      else
        out += raw[i];
    }
    return arena_.copy(out);
  }

  std::string_view with_line_ends(std::string_view raw) {
    return raw.find('\r') == std::string_view::npos ? raw : arena_.copy(xml_characters::line_ends(raw));
  }

  // Appends the text of the reference at the beginning of `raw`; returns its length in bytes.
  std::size_t reference(std::string_view raw, std::size_t offset, bool attribute, int depth,
                        std::string& out) {
    const std::size_t end = raw.substr(0, 256).find(';');
    if (end == std::string_view::npos || end < 2) {
      tolerate(offset, "'&' does not start a reference", "write &amp; for the character itself");
      return out += '&', 1;
    }
    const std::string_view key = raw.substr(1, end - 1);
    static constexpr std::pair<std::string_view, char> kKnown[] = {
        {"lt", '<'}, {"gt", '>'}, {"amp", '&'}, {"quot", '"'}, {"apos", '\''}};
    for (const auto& [known, character] : kKnown) {
      if (key == known) return out += character, end + 1;
    }
    if (key[0] == '#') {
      const char32_t code = character_reference(key.substr(1));
      if (code == 0) fail(offset, fmt::format("&{}; is not a character", key));
      return append_utf8(out, code), end + 1;
    }
    const auto found = entities_.find(key);
    if (found == entities_.end()) {
      tolerate(offset, fmt::format("the entity &{}; is not defined", key),
               "write &amp; for the character '&'");
      return out += '&', 1;
    }
    if (depth >= kEntityDepth) fail(offset, "entities are nested too deeply");
    insert_entity(found->second, offset, attribute, depth + 1, out);
    return end + 1;
  }
  void insert_entity(std::string_view value, std::size_t offset, bool attribute, int depth,
                     std::string& out) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (++entity_bytes_ > kEntityBytes) fail(offset, "its entities come to more than 1 MB");
      if (value[i] == '<') fail(offset, "entities that contain elements are not supported");
      if (value[i] == '&')
        i += reference(value.substr(i), offset, attribute, depth, out) - 1;
      else
        out += attribute && blank(value[i]) ? ' ' : value[i];
    }
  }

  std::shared_ptr<TreeSource> source_;
  Arena& arena_;
  std::string_view text_;
  XmlContent keep_;
  std::size_t at_ = 0;
  std::size_t parts_ = 0;
  TreeNode* root_ = nullptr;
  std::vector<TreeNode*> open_;
  bool lenient_ = false;
  bool declared_ = false;  // there was a <?xml ...?>
  std::vector<Diagnostic> tolerated_;
  std::string_view undeclared_, known_prefix_;  // the latter: declared by the root
  TreePlace undeclared_at_;
  bool decoded_blank_ = false;  // a reference stood for blanks, so that tidying has something to do
  std::map<std::string, std::string, std::less<>> entities_;
  std::size_t entity_bytes_ = 0;
};

}  // namespace

XmlTree parse_xml_tree(std::string text, const std::string& file, XmlContent keep, XmlRules rules) {
  auto source = std::make_shared<TreeSource>();
  source->file = std::make_shared<const std::string>(file);
  if (rules == XmlRules::lenient) {
    TolerantText tolerant = tolerant_text(text);
    source->text = std::move(tolerant.text);
    Parser parser(std::move(source), keep, rules);
    parser.changed(tolerant.first_changed);
    return parser.document();
  }
  std::string converted;
  try {
    const std::string_view utf8 = as_utf8(text, converted);
    if (utf8.data() == converted.data())
      source->text = std::move(converted);
    else if (utf8.size() == text.size())
      source->text = std::move(text);
    else
      source->text = utf8;
  } catch (const UnknownEncoding& problem) {
    throw InputError("xml.not_well_formed", make_location(file, 1, 1),
                     fmt::format("the encoding '{}' is not supported", problem.what()),
                     "save the file as UTF-8");
  }
  return Parser(std::move(source), keep, rules).document();
}

}  // namespace doppel
