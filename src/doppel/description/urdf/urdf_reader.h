#pragma once
// Typed reading of XML attributes, with a diagnostic at the place of each error.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/xml/xml.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API UrdfReader {
 public:
  explicit UrdfReader(Diagnostics& diagnostics) : diagnostics_(diagnostics) {}
  // For an element that can be left out: every error is a warning of `rule` with the replacement `instead`.
  UrdfReader(Diagnostics& diagnostics, std::string rule, std::string instead)
      : diagnostics_(diagnostics), rule_(std::move(rule)), instead_(std::move(instead)) {}

  // A required attribute; "" and an error if it is missing.
  std::string required(const XmlNode& node, std::string_view name);
  [[nodiscard]] static std::string optional(const XmlNode& node, std::string_view name);
  std::optional<double> number(const XmlNode& node, std::string_view name);
  double number_or(const XmlNode& node, std::string_view name, double fallback);
  // The number in an element's text: <mu1>0.8</mu1>.
  std::optional<double> number_inside(const XmlNode& node) { return number_of(node, node.content()); }
  // The number in `text`, which is part of `node`.
  std::optional<double> number_of(const XmlNode& node, const std::string& text);
  // `count` numbers separated by blanks; nullopt and an error otherwise.
  template <int count>
  std::optional<Eigen::Matrix<double, count, 1>> vector(const XmlNode& node, std::string_view name) {
    Eigen::Matrix<double, count, 1> out;
    if (!numbers(node, name, out.data(), count)) return std::nullopt;
    return out;
  }
  // The same of the numbers in `text`, which is part of `node`.
  template <int count>
  std::optional<Eigen::Matrix<double, count, 1>> vector_of(const XmlNode& node, const std::string& text) {
    Eigen::Matrix<double, count, 1> out;
    if (read_numbers(text, out.data(), count)) return out;
    fault("urdf.vector", node.where, not_numbers(node, text, count), kNumbersFix);
    return std::nullopt;
  }
  // Reports an error of `rule`, or a warning if the element can be left out.
  void fault(std::string rule, const SourceLocation& where, std::string message, std::string fix = "");
  [[nodiscard]] bool faulty() const { return faulty_; }

 private:
  bool numbers(const XmlNode& node, std::string_view name, double* out, int count);
  static bool read_numbers(const std::string& text, double* out, int count);
  static std::string not_numbers(const XmlNode& node, const std::string& text, int count);
  static constexpr const char* kNumbersFix =
      "write them with decimal points, separated by spaces, such as 0 0 0.25";
  Diagnostics& diagnostics_;
  std::string rule_, instead_;  // empty: faults are errors
  bool faulty_ = false;
};

}  // namespace doppel
