#include "doppel/base/xml/xml.h"

#include <algorithm>

#include "doppel/base/core/read_file.h"
#include "doppel/base/xml/xml_tree.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{64} << 20;

void write(const XmlNode& node, int depth, std::string& out) {
  const std::string indent(static_cast<std::size_t>(depth) * 2, ' ');
  out += indent + '<' + node.name;
  for (const XmlAttribute& a : node.attributes) out += ' ' + a.name + "=\"" + escape_xml(a.value, true) + '"';
  const bool only_text =
      !node.children.empty() && std::all_of(node.children.begin(), node.children.end(),
                                            [](const XmlNode& c) { return c.kind == XmlNode::Kind::text; });
  if (node.children.empty()) {
    out += "/>\n";
    return;
  }
  out += '>';
  if (only_text) {
    for (const XmlNode& child : node.children) out += escape_xml(child.text, false);
  } else {
    out += '\n';
    for (const XmlNode& child : node.children) {
      if (child.kind == XmlNode::Kind::element)
        write(child, depth + 1, out);
      else if (child.kind == XmlNode::Kind::text &&
               child.text.find_first_not_of(" \t\r\n") != std::string::npos)
        out += escape_xml(child.text, false);
    }
    out += indent;
  }
  out += "</" + node.name + ">\n";
}

}  // namespace

const XmlAttribute* XmlNode::find(std::string_view attribute) const {
  for (const XmlAttribute& a : attributes) {
    if (a.name == attribute) return &a;
  }
  return nullptr;
}

const XmlNode* XmlNode::first(std::string_view element) const {
  for (const XmlNode& child : children) {
    if (child.is(element)) return &child;
  }
  return nullptr;
}

std::string XmlNode::content() const {
  std::string out;
  for (const XmlNode& child : children) {
    if (child.kind == Kind::text) out += child.text;
  }
  const std::size_t begin = out.find_first_not_of(" \t\r\n");
  if (begin == std::string::npos) return "";
  return out.substr(begin, out.find_last_not_of(" \t\r\n") - begin + 1);
}

XmlNode parse_xml(std::string_view text, const std::string& file, XmlContent keep) {
  return parse_xml_tree(std::string(text), file, keep).node();
}

XmlTree load_xml_tree(const std::string& file, XmlContent keep, XmlRules rules) {
  return parse_xml_tree(read_file(file, kMaxFileBytes), file, keep, rules);
}

XmlNode load_xml(const std::string& file) {
  return load_xml_tree(file, XmlContent::content).node();
}

void append_escaped(std::string& out, std::string_view text, bool quotes) {
  std::size_t copied = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c != '&' && c != '<' && c != '>' && (c != '"' || !quotes)) continue;
    out.append(text, copied, i - copied);
    out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : "&quot;";
    copied = i + 1;
  }
  out.append(text, copied);
}

std::string escape_xml(std::string_view text, bool quotes) {
  std::string out;
  append_escaped(out, text, quotes);
  return out;
}

std::string to_xml(const XmlNode& node) {
  std::string out = "<?xml version=\"1.0\" ?>\n";
  write(node, 0, out);
  return out;
}

}  // namespace doppel
