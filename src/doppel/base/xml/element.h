#pragma once
// Construction of elements for written documents.

#include <string>
#include <utility>
#include <vector>

#include "doppel/base/xml/xml.h"
#include "doppel/export.h"

namespace doppel {

using XmlAttributes = std::vector<std::pair<std::string, std::string>>;

DOPPEL_API XmlNode element(std::string name, XmlAttributes attributes = {},
                           std::vector<XmlNode> children = {});
DOPPEL_API XmlNode text_element(std::string name, std::string text, XmlAttributes attributes = {});
DOPPEL_API XmlNode comment(std::string text);
DOPPEL_API void add_attribute(XmlNode& node, std::string name, std::string value);
DOPPEL_API std::string truth(bool value);

}  // namespace doppel
