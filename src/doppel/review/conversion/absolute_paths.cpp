#include "doppel/review/conversion/absolute_paths.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>

#include "doppel/base/xml/xml.h"

namespace doppel {
namespace {

bool is_path(std::string_view text) {
  if (text.starts_with("file://")) text.remove_prefix(7);
  std::error_code none;
  return text.starts_with('/') && text.size() > 1 && std::filesystem::exists(text, none);
}

class Search {
 public:
  Search(const std::string& file, Diagnostics& diagnostics) : file_(file), diagnostics_(diagnostics) {}

  void look(const XmlNode& node, const std::string& inside) {
    const std::string place = inside + "<" + node.name + ">";
    for (const XmlAttribute& attribute : node.attributes) warn(attribute.value, place);
    warn(node.content(), place);
    for (const XmlNode& child : node.children) {
      if (child.kind == XmlNode::Kind::element) look(child, node.name == "robot" ? "" : place);
    }
  }

 private:
  void warn(const std::string& value, const std::string& place) {
    if (!is_path(value) || !reported_.insert(value).second) return;
    diagnostics_.warning(
        "convert.absolute_path", make_location(file_),
        fmt::format("{} contains '{}', a path that exists only on this machine", place, value),
        "convert again where the result is used, or edit the path there; its consumers do not support "
        "package://");
  }

  const std::string& file_;
  Diagnostics& diagnostics_;
  std::set<std::string> reported_;
};

}  // namespace

void warn_of_absolute_paths(const std::string& document, const std::string& file, Diagnostics& diagnostics) {
  Search(file, diagnostics).look(parse_xml(document, file), "");
}

}  // namespace doppel
