#pragma once
// Elements of documents that are made rather than read.

#include <string>
#include <utility>
#include <vector>

#include "doppel/xml/xml.h"

namespace doppel {

using XmlAttributes = std::vector<std::pair<std::string, std::string>>;

XmlNode element(std::string name, XmlAttributes attributes = {}, std::vector<XmlNode> children = {});
XmlNode text_element(std::string name, std::string text, XmlAttributes attributes = {});
XmlNode comment(std::string text);
void add_attribute(XmlNode& node, std::string name, std::string value);
std::string truth(bool value);

}  // namespace doppel
