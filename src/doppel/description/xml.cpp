#include "doppel/description/xml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <memory>
#include <pugixml.hpp>
#include <sstream>

#include "doppel/core/diagnostic.h"

namespace doppel {
namespace {

// Turns byte offsets into lines and columns.
class Places {
 public:
  Places(const std::string& text, const std::string& file)
      : text_(text), file_(std::make_shared<const std::string>(file)), starts_{0} {
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] == '\n') starts_.push_back(i + 1);
    }
  }

  [[nodiscard]] SourceLocation at(std::size_t offset) const {
    const auto after = std::upper_bound(starts_.begin(), starts_.end(), std::min(offset, text_.size()));
    const auto line = static_cast<std::size_t>(after - starts_.begin());
    const auto column = std::min(offset, text_.size()) - starts_[line - 1] + 1;
    return {file_, static_cast<int>(line), static_cast<int>(column), nullptr};
  }

  // Where the attribute is written, for an element whose name begins at `offset`; pugixml does not keep it.
  [[nodiscard]] SourceLocation attribute(std::size_t offset, std::string_view name) const {
    char quote = 0;
    for (std::size_t i = offset; i < text_.size(); ++i) {
      const char c = text_[i];
      if (quote != 0) {
        if (c == quote) quote = 0;
        continue;
      }
      if (c == '"' || c == '\'') quote = c;
      if (c == '>') break;
      const bool begins = i > offset && std::isspace(static_cast<unsigned char>(text_[i - 1])) != 0;
      if (begins && text_.compare(i, name.size(), name) == 0) {
        const std::size_t end = text_.find_first_not_of(" \t\r\n", i + name.size());
        if (end != std::string::npos && text_[end] == '=') return at(i);
      }
    }
    return at(offset);
  }

 private:
  const std::string& text_;
  std::shared_ptr<const std::string> file_;
  std::vector<std::size_t> starts_;
};

XmlNode convert(const pugi::xml_node& from, const Places& places) {
  XmlNode to;
  const auto offset = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, from.offset_debug()));
  if (from.type() != pugi::node_element) {
    to.kind = XmlNode::Kind::text;
    to.text = from.value();
    to.where = places.at(offset);
    return to;
  }
  to.name = from.name();
  to.where = places.at(offset == 0 ? 0 : offset - 1);
  for (const pugi::xml_attribute& attribute : from.attributes()) {
    to.attributes.push_back(
        {attribute.name(), attribute.value(), places.attribute(offset, attribute.name())});
  }
  for (const pugi::xml_node& child : from.children()) {
    const auto type = child.type();
    if (type == pugi::node_element || type == pugi::node_pcdata || type == pugi::node_cdata) {
      to.children.push_back(convert(child, places));
    }
  }
  return to;
}

struct OpenTag {
  std::string name;
  std::size_t offset = 0;
};

// The innermost element that is still open at `end`.
OpenTag open_at(const std::string& text, std::size_t end) {
  std::vector<OpenTag> open;
  for (std::size_t i = 0; (i = text.find('<', i)) != std::string::npos && i < end;) {
    if (text.compare(i, 4, "<!--") == 0) {
      i = text.find("-->", i);
      if (i == std::string::npos) break;
      continue;
    }
    const std::size_t close = text.find('>', i);
    if (close == std::string::npos) break;
    if (text[i + 1] == '/') {
      if (close >= end) break;
      if (!open.empty()) open.pop_back();
    } else if (text[i + 1] != '?' && text[i + 1] != '!' && text[close - 1] != '/') {
      const std::size_t name_end = text.find_first_of(" \t\r\n>/", i + 1);
      open.push_back({text.substr(i + 1, name_end - i - 1), i});
    }
    i = close;
  }
  return open.empty() ? OpenTag{} : open.back();
}

[[noreturn]] void refuse(const pugi::xml_parse_result& result, const std::string& text,
                         const Places& places) {
  const auto offset = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, result.offset));
  std::string message = fmt::format("the XML is not well-formed: {}", result.description());
  std::string mend = "correct the XML at this place; nothing of the file was used";
  if (result.status == pugi::status_end_element_mismatch ||
      result.status == pugi::status_no_document_element) {
    const OpenTag open = open_at(text, offset);
    if (!open.name.empty()) {
      const SourceLocation opened = places.at(open.offset);
      message =
          fmt::format("the XML is not well-formed: <{}>, opened at line {}, column {}, is not closed here",
                      open.name, opened.line, opened.column);
      mend = fmt::format("close it with </{}> (or <{} .../>)", open.name, open.name);
    }
  }
  throw InputError("xml.not_well_formed", places.at(offset), message, mend);
}

std::string escaped(std::string_view text, bool attribute) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"' && attribute)
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

void write(const XmlNode& node, int depth, std::string& out) {
  const std::string indent(static_cast<std::size_t>(depth) * 2, ' ');
  out += indent + '<' + node.name;
  for (const XmlAttribute& a : node.attributes)
    out += fmt::format(" {}=\"{}\"", a.name, escaped(a.value, true));
  const bool only_text =
      !node.children.empty() && std::all_of(node.children.begin(), node.children.end(),
                                            [](const XmlNode& c) { return c.kind == XmlNode::Kind::text; });
  if (node.children.empty()) {
    out += "/>\n";
    return;
  }
  out += '>';
  if (only_text) {
    for (const XmlNode& child : node.children) out += escaped(child.text, false);
  } else {
    out += '\n';
    for (const XmlNode& child : node.children) {
      if (child.kind == XmlNode::Kind::element)
        write(child, depth + 1, out);
      else if (child.text.find_first_not_of(" \t\r\n") != std::string::npos)
        out += escaped(child.text, false);
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

XmlNode parse_xml(const std::string& text, const std::string& file) {
  const Places places(text, file);
  pugi::xml_document document;
  const auto options = pugi::parse_default | pugi::parse_ws_pcdata_single;
  const pugi::xml_parse_result result =
      document.load_buffer(text.data(), text.size(), options, pugi::encoding_utf8);
  if (!result) refuse(result, text, places);
  int elements = 0;
  for (const pugi::xml_node& node : document.children())
    elements += node.type() == pugi::node_element ? 1 : 0;
  if (elements != 1) {
    throw InputError("xml.not_well_formed", places.at(0),
                     fmt::format("the XML has {} root elements; it has to have one", elements));
  }
  return convert(document.document_element(), places);
}

XmlNode load_xml(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (in) text << in.rdbuf();
  if (!in) {
    throw InputError("file.unreadable", make_location(file),
                     fmt::format("'{}' cannot be read: {}", file, std::strerror(errno)));
  }
  return parse_xml(text.str(), file);
}

std::string to_xml(const XmlNode& node) {
  std::string out = "<?xml version=\"1.0\" ?>\n";
  write(node, 0, out);
  return out;
}

}  // namespace doppel
