#pragma once
// Building XML documents for other tools: elements in one line, numbers that read back as the same number.

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/xml/xml.h"

namespace doppel {

using XmlAttributes = std::vector<std::pair<std::string, std::string>>;

XmlNode element(std::string name, XmlAttributes attributes = {}, std::vector<XmlNode> children = {});
XmlNode text_element(std::string name, std::string text, XmlAttributes attributes = {});
XmlNode comment(std::string text);

// The shortest decimal that reads back as the same number; "0" for -0.
std::string decimal(double value);
std::string decimals(const Eigen::Vector3d& v);  // with blanks between
std::string truth(bool value);

// `wanted`, or with _2, _3 ... behind it where it is taken; the result is taken from now on.
std::string unique_name(const std::string& wanted, std::vector<std::string>& taken);

}  // namespace doppel
