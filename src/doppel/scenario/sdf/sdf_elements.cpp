#include "doppel/scenario/sdf/detail/sdf_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"

namespace doppel::sdf {
namespace {

constexpr std::size_t kMaxShown = 40;  // characters of a wrong value

// The elements below an element, from the SDFormat specification 1.11 and the older ones from 1.3. Sensors, plugins
// and GUIs are kept as text and are not looked into.
struct Kind {
  std::string_view name, used, without_effect;
};
constexpr Kind kKinds[] = {
    {"sdf", "world model light include actor", ""},
    {"world",
     "include model light frame joint gravity physics scene state plugin actor population name "
     "magnetic_field "
     "spherical_coordinates",
     "gui audio road atmosphere wind"},
    {"spherical_coordinates",
     "surface_model world_frame_orientation latitude_deg longitude_deg elevation heading_deg",
     "surface_axis_equatorial surface_axis_polar"},
    {"model", "pose static self_collide link joint frame include model plugin sensor",
     "allow_auto_disable enable_wind gripper origin"},
    {"include", "uri name pose static placement_frame plugin", "allow_auto_disable"},
    {"link", "pose inertial collision visual sensor gravity self_collide light origin plugin",
     "must_be_base_link kinematic velocity_decay enable_wind audio_sink audio_source battery projector "
     "particle_emitter damping"},
    {"inertial", "pose mass inertia density auto_inertia_params origin", "fluid_added_mass"},
    {"population", "pose model include model_count distribution box cylinder", "frame"},
    {"inertia", "ixx ixy ixz iyy iyz izz", ""},
    {"collision", "pose geometry surface density auto_inertia_params origin", "laser_retro max_contacts"},
    {"visual", "pose geometry material transparency origin plugin",
     "cast_shadows laser_retro meta visibility_flags"},
    {"geometry", "box sphere cylinder plane mesh capsule ellipsoid cone polyline heightmap empty", "image"},
    {"box", "size", ""},
    {"sphere", "radius", ""},
    {"cylinder", "radius length", ""},
    {"capsule", "radius length", ""},
    {"cone", "radius length", ""},
    {"ellipsoid", "radii", ""},
    {"plane", "normal size", ""},
    {"mesh", "uri filename scale submesh", "convex_decomposition"},
    {"polyline", "point height", ""},
    {"heightmap", "uri size pos texture blend", "sampling use_terrain_paging"},
    {"texture", "diffuse normal size", ""},
    {"blend", "min_height fade_dist", ""},
    {"surface", "friction bounce contact", "soft_contact"},
    {"friction", "ode bullet torsional", ""},
    {"joint",
     "pose parent child axis axis2 thread_pitch screw_thread_pitch gearbox_ratio gearbox_reference_body "
     "sensor origin",
     "physics plugin"},
    {"axis", "xyz limit dynamics mimic use_parent_model_frame initial_position", ""},
    {"limit", "lower upper effort velocity stiffness dissipation", ""},
    {"dynamics", "damping friction spring_stiffness spring_reference", ""},
    {"frame", "pose", ""},
    {"light", "pose diffuse specular range attenuation direction spot cast_shadows intensity origin light_on",
     "visualize"},
    {"material", "ambient diffuse specular emissive script pbr",
     "lighting shader double_sided render_order shininess"},
    {"metal", "albedo_map roughness_map roughness metalness_map metalness normal_map emissive_map",
     "environment_map ambient_occlusion_map light_map"},
    {"specular", "albedo_map glossiness normal_map emissive_map",
     "specular_map glossiness_map environment_map ambient_occlusion_map light_map"},
    {"scene", "ambient background shadows sky", "fog grid origin_visual"},
    {"sky", "time sunrise sunset", "clouds cubemap_uri"},
    {"physics", "max_step_size gravity",
     "real_time_factor real_time_update_rate max_contacts dart simbody bullet ode update_rate dartsim"},
    {"state", "model insertions light", "sim_time real_time wall_time iterations deletions time joint"},
};

const Kind* kind_named(std::string_view name) {
  const auto* const found =
      std::find_if(std::begin(kKinds), std::end(kKinds), [&](const Kind& kind) { return kind.name == name; });
  return found == std::end(kKinds) ? nullptr : found;
}

std::vector<std::string> words(std::string_view text) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = text.find_first_not_of(" \t\r\n", at);
    if (begin == std::string_view::npos) break;
    const std::size_t end = std::min(text.find_first_of(" \t\r\n", begin), text.size());
    out.emplace_back(text.substr(begin, end - begin));
    at = end;
  }
  return out;
}

bool has_word(std::string_view list, std::string_view word) {
  for (std::size_t at = list.find(word); at != std::string_view::npos; at = list.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || list[at - 1] == ' ') && (end == list.size() || list[end] == ' ')) return true;
  }
  return false;
}

std::optional<double> value_of_word(const std::string& word) {
  const std::string low = lowered(word);
  if (low == "inf" || low == "+inf" || low == "infinity") return std::numeric_limits<double>::infinity();
  if (low == "-inf" || low == "-infinity") return -std::numeric_limits<double>::infinity();
  return parse_number(word);
}

Eigen::Matrix3d rotation_of(const std::vector<double>& values, bool quaternion, bool degrees) {
  if (quaternion) {
    const Eigen::Quaterniond q(values[6], values[3], values[4], values[5]);
    return q.norm() > 1e-9 ? q.normalized().toRotationMatrix() : Eigen::Matrix3d::Identity();
  }
  const double unit = degrees ? std::numbers::pi / 180.0 : 1.0;
  return rotation_from_rpy(unit * Eigen::Vector3d(values[3], values[4], values[5]));
}

}  // namespace

std::string Elements::attribute(const XmlNode& node, std::string_view name) {
  const XmlAttribute* const found = node.find(name);
  return found == nullptr ? "" : found->value;
}

std::string Elements::text(const XmlNode& parent, std::string_view name) {
  const XmlNode* const node = parent.first(name);
  return node == nullptr ? "" : node->content();
}

std::optional<double> Elements::number(const XmlNode& parent, std::string_view name) {
  const XmlNode* const node = parent.first(name);
  if (node == nullptr) return std::nullopt;
  const std::string written = node->content();
  const std::optional<double> value = value_of_word(written);
  if (!value) {
    error("sdf.value", node->where,
          fmt::format("<{}> must be a number, not '{}'", name, written.substr(0, kMaxShown)),
          "write it with a decimal point, such as 0.25");
  }
  return value;
}

std::optional<std::vector<double>> Elements::numbers(const XmlNode& node, std::size_t least,
                                                     std::size_t most) {
  const std::string written = node.content();
  std::vector<double> out;
  bool fine = true;
  for (const std::string& word : words(written)) {
    const std::optional<double> value = parse_number(word);
    fine = fine && value;
    out.push_back(value.value_or(0));
  }
  if (fine && out.size() >= least && out.size() <= most) return out;
  error("sdf.value", node.where,
        fmt::format("<{}> must be {} numbers, not '{}'", node.name,
                    least == most ? std::to_string(least) : fmt::format("{} to {}", least, most),
                    written.substr(0, kMaxShown)),
        "write them with decimal points, separated by spaces");
  return std::nullopt;
}

std::optional<Eigen::Vector4d> Elements::colour(const XmlNode& parent, std::string_view name) {
  const XmlNode* const node = parent.first(name);
  if (node == nullptr || node->content().empty()) return std::nullopt;
  const auto values = numbers(*node, 3, 4);
  if (!values) return std::nullopt;
  return Eigen::Vector4d((*values)[0], (*values)[1], (*values)[2], values->size() > 3 ? (*values)[3] : 1.0)
      .cwiseMax(0)
      .cwiseMin(1);
}

bool Elements::truth(const XmlNode& parent, std::string_view name, bool fallback) {
  const XmlNode* const node = parent.first(name);
  if (node == nullptr) return fallback;
  const std::string written = lowered(node->content());
  if (written == "true" || written == "1") return true;
  if (written == "false" || written == "0" || written.empty()) return written.empty() ? fallback : false;
  error("sdf.value", node->where,
        fmt::format("<{}> must be true or false, not '{}'", name, written.substr(0, kMaxShown)));
  return fallback;
}

WrittenPose Elements::pose(const XmlNode& parent) {
  WrittenPose out;
  const XmlNode* node = parent.first("pose");
  if (node == nullptr)
    node = parent.first("origin");  // of SDF 1.0 to 1.2, in attributes; read as an empty pose
  if (node == nullptr) return out;
  out.where = node->where;
  out.relative_to = attribute(*node, node->find("relative_to") != nullptr ? "relative_to" : "frame");
  if (node->content().empty()) return out;
  const std::string format = attribute(*node, "rotation_format");
  const bool quaternion = format == "quat_xyzw";
  if (!format.empty() && !quaternion && format != "euler_rpy") {
    error("sdf.value", node->where,
          fmt::format("the rotation_format '{}' does not exist", format.substr(0, kMaxShown)),
          "write euler_rpy or quat_xyzw");
  }
  const std::size_t count = quaternion ? 7 : 6;
  const auto values = numbers(*node, count, count);
  if (!values) return out;
  const std::string degrees = attribute(*node, "degrees");
  out.X.translation() = Eigen::Vector3d((*values)[0], (*values)[1], (*values)[2]);
  out.X.linear() = rotation_of(*values, quaternion, degrees == "true" || degrees == "1");
  return out;
}

void Elements::check(const XmlNode& node, std::string_view name) {
  const Kind* const kind = kind_named(name);
  if (kind == nullptr) return;
  for (const XmlNode& child : node.children) {
    if (child.kind != XmlNode::Kind::element || has_word(kind->used, child.name)) continue;
    if (child.name.find(':') != std::string::npos) continue;  // an element of a tool's own
    if (has_word(kind->without_effect, child.name)) {
      without_effect(child.where, fmt::format("<{}> of a <{}>", child.name, name));
      continue;
    }
    const std::vector<std::string> known =
        words(std::string(kind->used) + " " + std::string(kind->without_effect));
    const std::string shown = child.name.substr(0, kMaxShown);
    const auto nearest = nearest_name(shown, known);
    diagnostics.note("sdf.unknown_element", child.where,
                     fmt::format("SDF has no <{}> below a <{}>; it is ignored{}", shown, name,
                                 nearest ? "; did you mean '" + *nearest + "'?" : ""));
  }
}

void Elements::without_effect(const SourceLocation& where, const std::string& what, const std::string& why) {
  if (!reported_.insert(what).second) return;
  diagnostics.note("sdf.no_effect", where,
                   fmt::format("{} has no effect{}{}", what, why.empty() ? "" : ": ", why));
}

}  // namespace doppel::sdf
