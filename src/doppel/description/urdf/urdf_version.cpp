#include "doppel/description/urdf/urdf_version.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "doppel/base/core/text.h"

namespace doppel {
namespace {

constexpr double kMinLength = 1e-9;  // of a quaternion

std::optional<int> natural(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size() && value >= 0;
  return whole ? std::optional(value) : std::nullopt;
}

}  // namespace

std::string to_string(UrdfVersion version) {
  return fmt::format("{}.{}", version.major_number, version.minor_number);
}

UrdfVersion read_urdf_version(const XmlNode& robot, Diagnostics& diagnostics) {
  const XmlAttribute* attribute = robot.find("version");
  if (attribute == nullptr) return {};
  const std::string_view text = attribute->value;
  const std::size_t dot = text.find('.');
  const auto major = natural(text.substr(0, dot));
  const auto minor = dot == std::string_view::npos ? std::nullopt : natural(text.substr(dot + 1));
  if (major && minor) {
    const UrdfVersion version{*major, *minor};
    if (version > UrdfVersion{} && version <= kUrdf12) {
      diagnostics.note(
          "urdf.version", attribute->where,
          fmt::format("version {} of URDF is read by ROS 2 Lyrical; Jazzy and Kilted reject the file",
                      to_string(version)));
    }
    if (version >= UrdfVersion{} && version <= kUrdf12) return version;
  }
  diagnostics.warning(
      "urdf.version", attribute->where,
      fmt::format(
          "version=\"{}\" of <robot> is not a version of URDF: ROS 2's parser rejects the file; it is "
          "read as of version {}",
          text, to_string(kUrdf12)),
      "write version=\"1.0\", \"1.1\" or \"1.2\", or remove the attribute, which means 1.0");
  return kUrdf12;
}

std::optional<Eigen::Vector3d> rpy_of_quaternion(std::string_view quat_xyzw) {
  std::istringstream words{std::string(quat_xyzw)};
  std::string word;
  Eigen::Vector4d xyzw;
  Eigen::Index count = 0;
  for (; words >> word; ++count) {
    const auto value = parse_number(word);
    if (!value || count == xyzw.size()) return std::nullopt;
    xyzw[count] = *value;
  }
  const double length = xyzw.stableNorm();
  if (count != xyzw.size() || !(length > kMinLength)) return std::nullopt;
  const Eigen::Quaterniond rotation(Eigen::Vector4d(xyzw / length));
  return rpy_from_rotation(rotation.toRotationMatrix());
}

void NewerElements::uses(std::string feature, UrdfVersion since, const SourceLocation& where) {
  const auto same = std::ranges::find(uses_, feature, &Use::feature);
  if (same != uses_.end()) {
    ++same->count;
  } else {
    uses_.push_back({std::move(feature), since, where, 1});
  }
}

void NewerElements::report(UrdfVersion version, Diagnostics& diagnostics) const {
  for (const Use& use : uses_) {
    if (use.since <= version) continue;
    diagnostics.warning(
        "urdf.version", use.where,
        fmt::format(
            "{} is of URDF {}, and the file is of version {}: it is read here, but ROS 2 ignores it{}",
            use.feature, to_string(use.since), to_string(version),
            use.count > 1 ? fmt::format(" (here and {} times more)", use.count - 1) : ""),
        fmt::format("write <robot version=\"{}\" ...> for Lyrical; Jazzy and Kilted reject such a file, and "
                    "read what 1.0 "
                    "has in its place",
                    to_string(use.since)));
  }
}

}  // namespace doppel
