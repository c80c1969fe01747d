#pragma once
// Typed reading of SDF elements, with a diagnostic at the place of each error, and the table of the elements that SDF
// has.

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/math/pose.h"
#include "doppel/base/xml/xml.h"

namespace doppel::sdf {

// The file that an element is in.
struct Source {
  std::filesystem::path folder;  // that relative URIs start at; empty: none
  std::pair<int, int> version{1, 11};
  XmlNode root;
  [[nodiscard]] bool before(int minor) const { return version < std::pair(1, minor); }
};

struct WrittenPose {
  Pose X = Pose::Identity();
  std::string relative_to;
  SourceLocation where;  // unknown: no <pose> was written
};

class Elements {
 public:
  explicit Elements(Diagnostics& found) : diagnostics(found) {}

  [[nodiscard]] static std::string attribute(const XmlNode& node, std::string_view name);
  // The content of the child; empty: there is none.
  [[nodiscard]] static std::string text(const XmlNode& parent, std::string_view name);
  // "inf" and "-inf" are infinite. nullopt: there is no child, or an error that is reported.
  std::optional<double> number(const XmlNode& parent, std::string_view name);
  double number_or(const XmlNode& parent, std::string_view name, double fallback) {
    return number(parent, name).value_or(fallback);
  }
  template <int N>
  std::optional<Eigen::Matrix<double, N, 1>> vector(const XmlNode& parent, std::string_view name) {
    const XmlNode* const node = parent.first(name);
    if (node == nullptr) return std::nullopt;
    const auto values = numbers(*node, N, N);
    if (!values) return std::nullopt;
    return Eigen::Matrix<double, N, 1>(Eigen::Map<const Eigen::Matrix<double, N, 1>>(values->data()));
  }
  // Red, green, blue and, where it is written, opacity.
  std::optional<Eigen::Vector4d> colour(const XmlNode& parent, std::string_view name);
  bool truth(const XmlNode& parent, std::string_view name, bool fallback);
  // The finite numbers of a text; nullopt and an error if they are not `least` to `most`.
  std::optional<std::vector<double>> numbers(const XmlNode& node, std::size_t least, std::size_t most);
  WrittenPose pose(const XmlNode& parent);

  // Notes the children of `node` that SDF does not have below a `kind` ("link") and, once for each name, those
  // without effect.
  void check(const XmlNode& node, std::string_view kind);
  // Notes, once for each `what`, that it has no effect.
  void without_effect(const SourceLocation& where, const std::string& what, const std::string& why = "");
  void error(std::string rule, const SourceLocation& where, std::string message, std::string fix = "") {
    diagnostics.error(std::move(rule), where, std::move(message), std::move(fix));
  }

  Diagnostics& diagnostics;

 private:
  std::set<std::string> reported_;
};

}  // namespace doppel::sdf
