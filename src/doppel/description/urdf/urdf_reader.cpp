#include "doppel/description/urdf/urdf_reader.h"

#include <fmt/format.h>

#include <sstream>

#include "doppel/base/core/text.h"

namespace doppel {

std::string UrdfReader::required(const XmlNode& node, std::string_view name) {
  if (const XmlAttribute* attribute = node.find(name)) return attribute->value;
  fault("urdf.missing_attribute", node.where, fmt::format("<{}> has no attribute '{}'", node.name, name),
        fmt::format("write <{} {}=\"...\">", node.name, name));
  return "";
}

std::string UrdfReader::optional(const XmlNode& node, std::string_view name) {
  const XmlAttribute* attribute = node.find(name);
  return attribute == nullptr ? "" : attribute->value;
}

std::optional<double> UrdfReader::number(const XmlNode& node, std::string_view name) {
  const XmlAttribute* attribute = node.find(name);
  if (attribute == nullptr) return std::nullopt;
  const auto value = parse_number(attribute->value);
  if (!value) {
    fault("urdf.number", attribute->where,
          fmt::format("{}=\"{}\" of <{}> is not a finite number", name, attribute->value, node.name),
          "write it with a decimal point and no unit, such as 0.25 or 1e-3");
  }
  return value;
}

double UrdfReader::number_or(const XmlNode& node, std::string_view name, double fallback) {
  return number(node, name).value_or(fallback);
}

std::optional<double> UrdfReader::number_of(const XmlNode& node, const std::string& text) {
  const auto value = parse_number(text);
  if (!value)
    fault("urdf.number", node.where,
          fmt::format("<{}> is '{}', which is not a finite number", node.name, text));
  return value;
}

void UrdfReader::fault(std::string rule, const SourceLocation& where, std::string message, std::string fix) {
  faulty_ = true;
  if (instead_.empty()) return diagnostics_.error(std::move(rule), where, std::move(message), std::move(fix));
  diagnostics_.warning(rule_, where,
                       fmt::format("{}{} {}", message, message.ends_with('?') ? "" : ";", instead_),
                       std::move(fix));
}

bool UrdfReader::read_numbers(const std::string& text, double* out, int count) {
  std::istringstream words(text);
  std::string word;
  int found = 0;
  bool good = true;
  while (words >> word) {
    const auto value = parse_number(word);
    good = good && value.has_value();
    if (value && found < count) out[found] = *value;
    ++found;
  }
  return good && found == count;
}

std::string UrdfReader::not_numbers(const XmlNode& node, const std::string& text, int count) {
  return fmt::format("<{}> is '{}', which is not {} finite numbers", node.name, text, count);
}

bool UrdfReader::numbers(const XmlNode& node, std::string_view name, double* out, int count) {
  const XmlAttribute* attribute = node.find(name);
  if (attribute == nullptr) return false;
  if (read_numbers(attribute->value, out, count)) return true;
  fault("urdf.vector", attribute->where,
        fmt::format("{}=\"{}\" of <{}> is not {} finite numbers", name, attribute->value, node.name, count),
        kNumbersFix);
  return false;
}

}  // namespace doppel
