// Inertia and collision shapes from a link's visual shapes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/description/meshes/convex_hull.h"
#include "doppel/description/meshes/mesh.h"
#include "doppel/description/meshes/mesh_report.h"
#include "doppel/description/overlay/detail/convex_parts.h"
#include "doppel/description/overlay/detail/hull_mesh.h"
#include "doppel/description/overlay/detail/overlay.h"
#include "doppel/description/urdf/urdf_parser.h"

namespace doppel::overlay_detail {
namespace {

// The link alone, typed and with its meshes found.
Link read_link(const std::string& name, const SourceLocation& where, const Surroundings& around) {
  const XmlNode* node = find_named(around.root, "link", name);
  if (node == nullptr || around.resolver == nullptr)
    impossible(where, fmt::format("the shapes of link '{}' cannot be evaluated", name));
  XmlNode alone = make_node("robot", where);
  alone.attributes.push_back({"name", "one_link", where});
  alone.children.push_back(*node);
  Diagnostics ignored;
  RobotDescription robot = read_urdf(alone, around.folder, *around.resolver, ignored);
  if (robot.links.empty()) impossible(where, fmt::format("link '{}' cannot be read", name));
  return std::move(robot.links.front());
}

struct PlacedShape {
  Pose X_LS;  // in the link's frame
  ShapeReport report;
};

template <class Shapes>
std::vector<PlacedShape> placed(const Shapes& shapes) {
  std::vector<PlacedShape> out;
  for (const auto& shape : shapes) {
    if (auto report = report_shape(shape.geometry)) out.push_back({shape.origin.pose(), *std::move(report)});
  }
  return out;
}

// All solid shapes of the link together, of density 1. A mesh that is not closed is rejected, because its
// hull would give a wrong inertia.
MassProperties solid_of(const Link& link, const SourceLocation& where) {
  const bool visible = !link.visuals.empty();
  const std::vector<PlacedShape> shapes = visible ? placed(link.visuals) : placed(link.collisions);
  const std::size_t written = visible ? link.visuals.size() : link.collisions.size();
  if (shapes.empty() || shapes.size() != written) {
    impossible(where,
               fmt::format("the inertia of link '{}' cannot be computed: {}", link.name,
                           written == 0 ? "it has no shape" : "a mesh of it cannot be read"),
               "give the values instead (set_inertia)");
  }
  MassProperties sum;
  for (const PlacedShape& shape : shapes) {
    if (!shape.report.watertight || std::abs(shape.report.solid.volume) < 1e-18) {
      impossible(where,
                 fmt::format("the inertia of link '{}' cannot be computed: a mesh of it is not closed, so it "
                             "encloses no solid",
                             link.name),
                 "close the mesh, or give the values instead (set_inertia)");
    }
    MassProperties body = shape.report.solid.unit;
    if (shape.report.solid.volume < 0) {
      body.mass = -body.mass;
      body.I = -body.I;
    }
    body = transformed(body, shape.X_LS);
    sum = sum.mass > 0 ? combined(sum, body) : body;
  }
  return sum;
}

double wanted_mass(const Operation& operation, const ComputeInertia& action, const Facts& was,
                   double volume) {
  if (action.mass) return *action.mass;
  if (action.density) return *action.density * volume;
  const std::string* text = find_fact(was, "mass");
  const auto mass = text != nullptr ? number_of(*text) : std::nullopt;
  if (!mass || *mass <= 0) {
    impossible(operation.where,
               fmt::format("link '{}' has no mass to distribute over its shapes", action.link),
               "give one: mass, or density in kg/m^3");
  }
  return *mass;
}

// Seven digits exceed the accuracy of any shape, and keep the file readable.
std::string rounded(double value, double smallest) {
  if (std::abs(value) < smallest) return "0";
  return number_text(number_of(fmt::format("{:.7g}", value)).value_or(value));
}

std::string rounded(const Eigen::Vector3d& v) {
  return fmt::format("{} {} {}", rounded(v.x(), 1e-9), rounded(v.y(), 1e-9), rounded(v.z(), 1e-9));
}

// A box around everything that can be touched, in the link's axes.
Eigen::AlignedBox3d bounds_of(const Link& link, const SourceLocation& where) {
  Eigen::AlignedBox3d box;
  for (const PlacedShape& shape : link.collisions.empty() ? placed(link.visuals) : placed(link.collisions)) {
    for (const Eigen::Vector3d& p : shape.report.hull) box.extend(shape.X_LS * p);
  }
  if (box.isEmpty()) impossible(where, fmt::format("link '{}' has no shape that can be read", link.name));
  return box;
}

std::vector<Eigen::Vector3d> corners_of(const Link& link) {
  std::vector<Eigen::Vector3d> points;
  for (const PlacedShape& shape : link.collisions.empty() ? placed(link.visuals) : placed(link.collisions)) {
    for (const Eigen::Vector3d& p : shape.report.hull) points.push_back(shape.X_LS * p);
  }
  return points;
}

std::string file_name(const std::string& link) {
  std::string out;
  for (const char c : link) out += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' ? c : '_';
  return out;
}

std::string hull_name(const std::string& link) {
  return file_name(link) + "_hull.stl";
}

// Triangles of a mesh as they are, of a primitive as its hull, in the link's frame.
std::vector<Triangle> surface_of(const Geometry& geometry, const Pose& X_LS) {
  std::vector<Triangle> out;
  if (const auto* mesh = std::get_if<MeshGeometry>(&geometry)) {
    const TriangleMesh loaded = load_mesh(*mesh);
    for (const auto& t : loaded.triangles) {
      const auto corner = [&](std::size_t i) -> Eigen::Vector3d {
        return X_LS * loaded.vertices[t[i]].cast<double>();
      };
      out.push_back({corner(0), corner(1), corner(2)});
    }
    return out;
  }
  std::vector<Eigen::Vector3f> points;
  if (const auto report = report_shape(geometry)) {
    for (const Eigen::Vector3d& p : report->hull) points.push_back((X_LS * p).cast<float>());
  }
  for (const auto& [a, b, c] : convex_hull(points).triangles)
    out.push_back({points[a].cast<double>(), points[b].cast<double>(), points[c].cast<double>()});
  return out;
}

// All inputs that determine the parts of a shape.
std::string key_of(const Geometry& geometry, const Origin& origin) {
  std::string key = vector_text(origin.xyz) + '\n' + vector_text(origin.rpy) + '\n';
  if (const auto* mesh = std::get_if<MeshGeometry>(&geometry)) {
    std::error_code none;
    key += fmt::format("{}\n{}\n{}\n{}\n", mesh->path, vector_text(mesh->scale),
                       std::filesystem::file_size(mesh->path, none),
                       std::filesystem::last_write_time(mesh->path, none).time_since_epoch().count());
  } else if (const auto report = report_shape(geometry)) {
    for (const Eigen::Vector3d& p : report->hull) key += vector_text(p) + '\n';
  }
  return key;
}

template <class Shapes>
std::vector<std::filesystem::path> part_files(const std::string& link, const Shapes& shapes) {
  std::string key;
  for (const auto& shape : shapes) key += key_of(shape.geometry, shape.origin);
  return write_parts(key, file_name(link) + "_part", [&] {
    Parts all;
    for (const auto& shape : shapes) {
      const std::vector<Triangle> surface = surface_of(shape.geometry, shape.origin.pose());
      if (surface.empty()) continue;
      for (auto& part : convex_parts(surface)) all.push_back(std::move(part));
    }
    return all;
  });
}

XmlNode collision_node(const Eigen::Vector3d& xyz, XmlNode shape, const SourceLocation& where) {
  XmlNode collision = make_node("collision", where);
  XmlNode& origin = collision.children.emplace_back(make_node("origin", where));
  set_attribute(origin, "xyz", vector_text(xyz), where);
  set_attribute(origin, "rpy", "0 0 0", where);
  XmlNode& geometry = collision.children.emplace_back(make_node("geometry", where));
  geometry.children.push_back(std::move(shape));
  return collision;
}

XmlNode mesh_collision(const std::filesystem::path& file, const SourceLocation& where) {
  XmlNode shape = make_node("mesh", where);
  set_attribute(shape, "filename", "file://" + file.string(), where);
  return collision_node(Eigen::Vector3d::Zero(), std::move(shape), where);
}

std::vector<XmlNode> new_collisions(const ReplaceCollision& action, const SourceLocation& where,
                                    const Surroundings& around) {
  if (action.by == "none") return {};
  const Link link = read_link(action.link, where, around);
  std::vector<XmlNode> out;
  if (action.by == "box") {
    const Eigen::AlignedBox3d box = bounds_of(link, where);
    XmlNode shape = make_node("box", where);
    set_attribute(shape, "size", rounded(box.sizes()), where);
    out.push_back(collision_node(*vector_of(rounded(box.center())), std::move(shape), where));
  } else if (action.by == "hull") {
    if (const auto file = write_hull(corners_of(link), hull_name(action.link)))
      out.push_back(mesh_collision(*file, where));
  } else {
    for (const auto& file : link.collisions.empty() ? part_files(link.name, link.visuals)
                                                    : part_files(link.name, link.collisions))
      out.push_back(mesh_collision(file, where));
  }
  if (out.empty()) impossible(where, fmt::format("the shapes of link '{}' enclose no volume", link.name));
  return out;
}

}  // namespace

Facts computed_inertia(const Operation& operation, const Facts& was, const Surroundings& around) {
  const auto& action = std::get<ComputeInertia>(operation.action);
  const MassProperties solid = solid_of(read_link(action.link, operation.where, around), operation.where);
  const double mass = wanted_mass(operation, action, was, solid.mass);
  const Eigen::Matrix3d I = solid.I * (mass / solid.mass);
  const double tiny = 1e-12 * I.trace();
  return {{"mass", number_text(mass)},     {"com", rounded(solid.com)},     {"inertial_rpy", "0 0 0"},
          {"ixx", rounded(I(0, 0), tiny)}, {"ixy", rounded(I(0, 1), tiny)}, {"ixz", rounded(I(0, 2), tiny)},
          {"iyy", rounded(I(1, 1), tiny)}, {"iyz", rounded(I(1, 2), tiny)}, {"izz", rounded(I(2, 2), tiny)}};
}

std::string replaced_collision(const ReplaceCollision& action, const SourceLocation& where,
                               const Surroundings& around) {
  if (action.by == "none") return kNone;
  if (action.by == "hull") return "mesh " + hull_name(action.link);
  XmlNode link = make_node("link", where);
  link.children = new_collisions(action, where, around);
  return shapes_text(link, "collision");
}

void replace_collision(const ReplaceCollision& action, const SourceLocation& where,
                       const Surroundings& around) {
  XmlNode& link = *find_named(around.root, "link", action.link);
  std::vector<XmlNode> made = new_collisions(action, where, around);
  std::erase_if(link.children, [](const XmlNode& child) { return child.is("collision"); });
  for (XmlNode& node : made) link.children.push_back(std::move(node));
}

}  // namespace doppel::overlay_detail
