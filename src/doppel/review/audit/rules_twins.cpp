// Links that should have the same mass: left and right by name, and parts with the same mesh.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include "doppel/base/core/text.h"
#include "doppel/review/audit/detail/inertia_rules.h"

namespace doppel::audit_rules {
namespace {

constexpr double kSameMass = 0.01, kSameMoments = 0.05;

bool same(double a, double b, double slack) {
  return std::abs(a - b) <= slack * std::max(std::abs(a), std::abs(b));
}

const MeshGeometry* only_mesh(const Link& link) {
  if (link.visuals.size() != 1) return nullptr;
  const auto* mesh = std::get_if<MeshGeometry>(&link.visuals.front().geometry);
  return mesh == nullptr || mesh->path.empty() ? nullptr : mesh;
}

std::string difference(const Inertial& a, const Inertial& b) {
  if (!same(a.mass, b.mass, kSameMass)) return fmt::format("masses {:g} and {:g} kg", a.mass, b.mass);
  const Eigen::Vector3d p = principal_moments(components_of(a)), q = principal_moments(components_of(b));
  for (int i = 0; i < 3; ++i) {
    if (!same(p[i], q[i], kSameMoments)) {
      return fmt::format("principal moments {:.3g}, {:.3g}, {:.3g} and {:.3g}, {:.3g}, {:.3g} kg m^2", p[0],
                         p[1], p[2], q[0], q[1], q[2]);
    }
  }
  return "";
}

void compare(const Link& a, const Link& b, const char* why, Findings& out) {
  const std::string what = difference(*a.inertial, *b.inertial);
  if (what.empty()) return;
  out.add("inertia.twins", fmt::format("links '{}' and '{}'", a.name, b.name), b.inertial->source,
          fmt::format("{}, but have {}", why, what));
}

}  // namespace

std::string mirrored_name(const std::string& name) {
  std::string low = lowered(name);
  if (const std::size_t at = low.find("left"); at != std::string::npos) return low.replace(at, 4, "right");
  const auto boundary = [&](std::size_t i) {
    return i >= low.size() || std::isalpha(static_cast<unsigned char>(low[i])) == 0;
  };
  for (std::size_t i = 0; i < low.size(); ++i) {
    if (low[i] == 'l' && boundary(i + 1) && (i == 0 || boundary(i - 1))) {
      std::string out = low;
      out[i] = 'r';
      return out;
    }
  }
  return "";
}

void check_twins(const AuditInput& in, Findings& out) {
  std::map<std::string, const Link*> by_name;
  for (const Link& link : in.robot.links) {
    if (link.inertial && readable(in, link, out)) by_name.emplace(lowered(link.name), &link);
  }
  for (const Link& link : in.robot.links) {
    const bool weighed = link.inertial && readable(in, link, out);
    const std::string other = weighed ? mirrored_name(link.name) : "";
    const auto twin = other.empty() ? by_name.end() : by_name.find(other);
    if (twin != by_name.end()) compare(link, *twin->second, "their names mark them as left and right", out);
  }
  std::map<std::string, const Link*> by_mesh;
  for (const Link& link : in.robot.links) {
    const MeshGeometry* mesh = link.inertial && readable(in, link, out) ? only_mesh(link) : nullptr;
    if (mesh == nullptr) continue;
    const Eigen::Vector3d scale = mesh->scale.cwiseAbs();
    const auto [first, fresh] =
        by_mesh.emplace(fmt::format("{} {} {} {}", mesh->path, scale.x(), scale.y(), scale.z()), &link);
    const bool by_names = mirrored_name(link.name) == lowered(first->second->name) ||
                          mirrored_name(first->second->name) == lowered(link.name);
    if (!fresh && !by_names) compare(*first->second, link, "they use the same mesh", out);
  }
}

}  // namespace doppel::audit_rules
