#pragma once
// Typed reading of XML attributes, each fault told at its place.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "doppel/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/xml/xml.h"

namespace doppel {

// A finite number in the C locale with nothing but blanks around it.
DOPPEL_API std::optional<double> parse_number(std::string_view text);

class DOPPEL_API UrdfReader {
 public:
  explicit UrdfReader(Diagnostics& diagnostics) : diagnostics_(diagnostics) {}
  // Of something that can be left out: every fault is a warning of this rule that says what happens instead.
  UrdfReader(Diagnostics& diagnostics, std::string rule, std::string instead)
      : diagnostics_(diagnostics), rule_(std::move(rule)), instead_(std::move(instead)) {}

  // A required attribute; "" and an error where it is missing.
  std::string required(const XmlNode& node, std::string_view name);
  [[nodiscard]] static std::string optional(const XmlNode& node, std::string_view name);
  std::optional<double> number(const XmlNode& node, std::string_view name);
  double number_or(const XmlNode& node, std::string_view name, double fallback);
  // The number that an element's text is: <mu1>0.8</mu1>.
  std::optional<double> number_inside(const XmlNode& node) { return number_of(node, node.content()); }
  // The number that `text`, which `node` holds, is.
  std::optional<double> number_of(const XmlNode& node, const std::string& text);
  // `count` numbers separated by blanks; nothing and an error where they are not.
  template <int count>
  std::optional<Eigen::Matrix<double, count, 1>> vector(const XmlNode& node, std::string_view name) {
    Eigen::Matrix<double, count, 1> out;
    if (!numbers(node, name, out.data(), count)) return std::nullopt;
    return out;
  }
  // An error of `rule`; a warning where what is read can be left out.
  void fault(std::string rule, const SourceLocation& where, std::string message, std::string fix = "");
  [[nodiscard]] bool faulty() const { return faulty_; }

 private:
  bool numbers(const XmlNode& node, std::string_view name, double* out, int count);
  Diagnostics& diagnostics_;
  std::string rule_, instead_;  // empty: faults are errors
  bool faulty_ = false;
};

}  // namespace doppel
