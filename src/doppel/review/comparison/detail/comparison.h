#pragma once
// Shared by the parts of the comparison.

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "doppel/base/math/units.h"
#include "doppel/review/comparison/comparison.h"

namespace doppel::comparison {

// Collects the changes of one subject.
class Changes {
 public:
  Changes(std::vector<Change>& out, std::string subject, std::string name)
      : out_(out), subject_(std::move(subject)), name_(std::move(name)) {}

  void add(std::string aspect, std::string from, std::string to, std::string meaning = "") {
    out_.push_back({Change::Kind::changed, subject_, name_, std::move(aspect), std::move(from), std::move(to),
                    std::move(meaning)});
  }
  void text(const char* aspect, const std::string& from, const std::string& to) {
    if (from != to) add(aspect, from, to);
  }
  // scale and unit: for the text of the change.
  void number(const char* aspect, double from, double to, double scale, const char* unit) {
    if (!same(from, to)) add(aspect, shown(from * scale, unit), shown(to * scale, unit));
  }
  void number(const char* aspect, std::optional<double> from, std::optional<double> to, double scale,
              const char* unit) {
    if (from && to) return number(aspect, *from, *to, scale, unit);
    const auto one = [&](std::optional<double> v) {
      return v ? shown(*v * scale, unit) : std::string("none");
    };
    if (from || to) add(aspect, one(from), one(to));
  }

  static bool same(double a, double b) {
    return a == b || std::abs(a - b) <= kSameRelative * std::max(std::abs(a), std::abs(b)) ||
           std::abs(a - b) < 1e-12;
  }
  static std::string shown(double value, const char* unit) {
    return fmt::format("{:.6g}{}{}", value == 0 ? 0.0 : value, *unit == '\0' ? "" : " ", unit);
  }
  static std::string shown(const Eigen::Vector3d& v, double scale, const char* unit) {
    return fmt::format("{:.6g} {:.6g} {:.6g}{}{}", v.x() * scale + 0.0, v.y() * scale + 0.0,
                       v.z() * scale + 0.0, *unit == '\0' ? "" : " ", unit);
  }

 private:
  std::vector<Change>& out_;
  std::string subject_, name_;
};

void compare_joint(const Joint& a, const Joint& b, std::vector<Change>& out);  // joints.cpp
void compare_link(const Link& a, const Link& b, std::vector<Change>& out);     // links.cpp
void compare_control(const RobotDescription& a, const RobotDescription& b,
                     std::vector<Change>& out);  // control.cpp

}  // namespace doppel::comparison
