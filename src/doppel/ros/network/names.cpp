#include "doppel/ros/network/names.h"

#include <algorithm>
#include <array>

namespace doppel::ros2 {
namespace {

constexpr std::string_view kNamespaceMark = "::dds_::";

struct Mangling {
  NameKind kind;
  std::string_view prefix, suffix;
};
constexpr std::array<Mangling, 3> kManglings{
    {{NameKind::topic, "rt", ""}, {NameKind::request, "rq", "Request"}, {NameKind::reply, "rr", "Reply"}}};

std::string replace_all(std::string_view text, std::string_view from, std::string_view to) {
  std::string result;
  for (std::size_t at = 0;;) {
    const std::size_t found = text.find(from, at);
    result.append(text.substr(at, found - at));
    if (found == std::string_view::npos) return result;
    result.append(to);
    at = found + from.size();
  }
}

// A superset of the characters of ROS 2's names; peers may send anything.
bool has_other_characters(std::string_view name) {
  return std::ranges::any_of(name, [](char c) { return c <= ' ' || c > '~'; });
}

}  // namespace

std::string dds_name(NameKind kind, std::string_view ros_name) {
  for (const Mangling& m : kManglings) {
    if (m.kind != kind) continue;
    return std::string(m.prefix).append(ros_name).append(m.suffix);
  }
  return std::string(ros_name);
}

std::string dds_type(std::string_view ros_type) {
  const std::size_t slash = ros_type.rfind('/');
  if (slash == std::string_view::npos) return std::string(ros_type);
  return replace_all(ros_type.substr(0, slash), "/", "::")
      .append(kNamespaceMark)
      .append(ros_type.substr(slash + 1))
      .append("_");
}

std::optional<RosName> ros_name(std::string_view dds_name) {
  if (has_other_characters(dds_name)) return std::nullopt;
  for (const Mangling& m : kManglings) {
    if (!dds_name.starts_with(m.prefix) || !dds_name.ends_with(m.suffix)) continue;
    const std::string_view rest = dds_name.substr(m.prefix.size());
    if (rest.size() < m.suffix.size() + 2 || rest[0] != '/') continue;
    return RosName{m.kind, std::string(rest.substr(0, rest.size() - m.suffix.size()))};
  }
  return std::nullopt;
}

std::optional<std::string> ros_type(std::string_view dds_type) {
  if (has_other_characters(dds_type)) return std::nullopt;
  const std::size_t mark = dds_type.find(kNamespaceMark);
  if (mark == std::string_view::npos || mark == 0 || !dds_type.ends_with('_')) return std::nullopt;
  std::string_view name = dds_type.substr(mark + kNamespaceMark.size());
  name.remove_suffix(1);
  if (name.empty()) return std::nullopt;
  return replace_all(dds_type.substr(0, mark), "::", "/").append("/").append(name);
}

}  // namespace doppel::ros2
