#include "doppel/scenario/sdf/detail/sdf_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/description/meshes/heightmap.h"
#include "doppel/description/meshes/shape_mesh.h"
#include "doppel/description/urdf/contact_surface.h"
#include "doppel/robot/kinematics/link_solid.h"

namespace doppel::sdf {
namespace {

constexpr double kSdfFriction = 1.0;  // SDF's mu
constexpr std::size_t kMaxPlacesNamed = 6;
constexpr std::size_t kMaxOutline = 500;  // points: cutting it into convex parts takes their third power

Origin origin_of(const Pose& X, const SourceLocation& where) {
  return {X.translation(), rpy_from_rotation(X.linear()), where};
}

const XmlNode* first_of(const XmlNode& parent, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (const XmlNode* const node = parent.first(name)) return node;
  }
  return nullptr;
}

}  // namespace

void Files::add_missing(const std::string& uri) {
  if (std::find(missing_.begin(), missing_.end(), uri) == missing_.end()) missing_.push_back(uri);
}

std::string Files::find(const std::string& uri, const std::filesystem::path& folder,
                        const SourceLocation& where) {
  if (finder_) {
    try {
      return finder_(uri).string();
    } catch (const InputError& refused) {
      for (const Diagnostic& one : refused.diagnostics())
        diagnostics_.error(one.rule, where, one.message, one.fix);
      return "";
    }
  }
  if (search_ == nullptr || uri.empty()) return "";
  const FoundFile& found = search_->find(uri, folder);
  if (!found.path.empty()) return found.path.string();
  if (std::find(missing_.begin(), missing_.end(), uri) != missing_.end()) return "";
  add_missing(uri);
  std::vector<std::string> tried = found.tried;
  if (tried.size() > kMaxPlacesNamed) tried.resize(kMaxPlacesNamed);
  diagnostics_.warning("sdf.missing_file", where,
                       fmt::format("the file '{}' is not found; searched: {}", uri, fmt::join(tried, ", ")),
                       "set GZ_SIM_RESOURCE_PATH to the folder of the models");
  return "";
}

std::vector<Visual> ShapeReader::visuals(const XmlNode& node, const Pose& X_L, const Source& source) {
  elements_.check(node, "visual");
  std::vector<Visual> out;
  const std::optional<Material> look = material(node, source);
  for (PlacedGeometry& part : geometry(node, source)) {
    Visual visual;
    visual.name = Elements::attribute(node, "name");
    visual.origin = origin_of(X_L * part.X, node.where);
    visual.geometry = std::move(part.geometry);
    visual.material = look;
    visual.source = node.where;
    out.push_back(std::move(visual));
  }
  return out;
}

std::vector<Collision> ShapeReader::collisions(const XmlNode& node, const Pose& X_L, const Source& source) {
  elements_.check(node, "collision");
  std::vector<Collision> out;
  const ContactSurface contact = surface(node);
  for (PlacedGeometry& part : geometry(node, source)) {
    Collision collision;
    collision.name = Elements::attribute(node, "name");
    collision.origin = origin_of(X_L * part.X, node.where);
    collision.geometry = std::move(part.geometry);
    collision.source = node.where;
    collision.surface = contact;
    out.push_back(std::move(collision));
  }
  return out;
}

std::vector<PlacedGeometry> ShapeReader::geometry(const XmlNode& parent, const Source& source) {
  const XmlNode* const node = parent.first("geometry");
  if (node == nullptr) {
    elements_.diagnostics.warning("sdf.no_geometry", parent.where,
                                  fmt::format("this <{}> has no <geometry>; it is left out", parent.name),
                                  "write a <geometry> with one shape");
    return {};
  }
  elements_.check(*node, "geometry");
  for (const XmlNode& child : node->children) {
    if (child.kind != XmlNode::Kind::element || child.is("empty")) continue;
    elements_.check(child, child.name);
    std::vector<PlacedGeometry> out = shape(child, source);
    if (!out.empty()) return out;
  }
  return {};
}

double ShapeReader::size(const XmlNode& node, const char* name) {
  const std::optional<double> value = elements_.number(node, name);
  if (value && *value >= 0 && std::isfinite(*value)) return *value;
  if (value) {
    elements_.error("sdf.value", node.where,
                    fmt::format("<{}> of this <{}> is {}; it must not be negative", name, node.name, *value),
                    "write the size in m");
  } else if (node.first(name) == nullptr) {
    elements_.diagnostics.warning(
        "sdf.default_size", node.where,
        fmt::format("this <{}> has no <{}>; SDF's default of 1 m is taken", node.name, name),
        "write the size in m");
    return 1;
  }
  return 0;
}

std::vector<PlacedGeometry> ShapeReader::shape(const XmlNode& node, const Source& source) {
  const auto one = [](Geometry geometry) { return std::vector<PlacedGeometry>{{std::move(geometry)}}; };
  if (node.is("box")) return one(Box{elements_.vector<3>(node, "size").value_or(Eigen::Vector3d::Ones())});
  if (node.is("sphere")) return one(Sphere{size(node, "radius")});
  if (node.is("cylinder")) return one(Cylinder{size(node, "radius"), size(node, "length")});
  if (node.is("capsule")) return one(Capsule{size(node, "radius"), size(node, "length")});
  if (node.is("cone")) return one(Cone{size(node, "radius"), size(node, "length")});
  if (node.is("ellipsoid"))
    return one(Ellipsoid{elements_.vector<3>(node, "radii").value_or(Eigen::Vector3d::Ones())});
  if (node.is("plane")) {
    Plane plane;
    plane.normal = elements_.vector<3>(node, "normal").value_or(plane.normal);
    if (!(plane.normal.norm() > 1e-9)) plane.normal = Eigen::Vector3d::UnitZ();
    plane.size = elements_.vector<2>(node, "size").value_or(plane.size);
    return one(plane);
  }
  if (node.is("polyline")) return polyline(node);
  if (node.is("mesh")) {
    auto found = mesh(node, source);
    return found ? one(std::move(*found)) : std::vector<PlacedGeometry>{};
  }
  if (node.is("heightmap")) {
    auto found = heightmap(node, source);
    return found ? std::vector<PlacedGeometry>{std::move(*found)} : std::vector<PlacedGeometry>{};
  }
  return {};
}

std::vector<PlacedGeometry> ShapeReader::polyline(const XmlNode& node) {
  std::vector<Eigen::Vector2d> outline;
  for (const XmlNode& child : node.children) {
    if (!child.is("point")) continue;
    if (const auto p = elements_.numbers(child, 2, 2)) outline.emplace_back((*p)[0], (*p)[1]);
  }
  const double height = node.first("height") == nullptr ? 1.0 : size(node, "height");
  std::vector<PlacedGeometry> out;
  if (outline.size() > kMaxOutline) {
    elements_.error(
        "sdf.value", node.where,
        fmt::format("this <polyline> has {} points; at most {} are read", outline.size(), kMaxOutline),
        "use a mesh");
    return out;
  }
  for (auto& part : convex_parts(outline)) out.push_back({Extrusion{std::move(part), height}});
  if (out.empty()) {
    elements_.diagnostics.warning("sdf.polyline", node.where,
                                  "this <polyline> encloses no area; it is left out",
                                  "write at least three <point> in the order of the outline");
  }
  return out;
}

std::optional<PlacedGeometry> ShapeReader::heightmap(const XmlNode& node, const Source& source) {
  Heightmap out;
  out.image = image(node, "uri", source);
  if (out.image.uri.empty()) {
    elements_.error("sdf.value", node.where, "this <heightmap> has no <uri>", "name a PNG or JPEG image");
    return std::nullopt;
  }
  out.size = elements_.vector<3>(node, "size").value_or(out.size);
  for (const XmlNode& child : node.children) {
    if (child.is("texture")) {
      elements_.check(child, "texture");
      out.textures.push_back({image(child, "diffuse", source), image(child, "normal", source),
                              elements_.number_or(child, "size", Heightmap::Texture{}.size)});
    } else if (child.is("blend")) {
      elements_.check(child, "blend");
      out.blends.push_back(
          {elements_.number_or(child, "min_height", 0), elements_.number_or(child, "fade_dist", 0)});
    }
  }
  out.field = field_of(out, node.where);
  PlacedGeometry placed;
  placed.X.translation() = elements_.vector<3>(node, "pos").value_or(Eigen::Vector3d::Zero());
  placed.geometry = std::move(out);
  return placed;
}

std::shared_ptr<const HeightField> ShapeReader::field_of(const Heightmap& map, const SourceLocation& where) {
  if (map.image.path.empty()) return nullptr;
  const std::string key =
      fmt::format("{} {} {} {}", map.image.path, map.size.x(), map.size.y(), map.size.z());
  const auto [at, fresh] = fields_.try_emplace(key);
  if (!fresh) return at->second;
  try {
    at->second = std::make_shared<const HeightField>(load_heightmap(map));
  } catch (const InputError& refused) {
    for (const Diagnostic& one : refused.diagnostics())
      elements_.diagnostics.warning(
          one.rule, where,
          fmt::format("'{}' collides with nothing and is not drawn: {}", map.image.uri, one.message),
          one.fix);
  }
  return at->second;
}

std::optional<Geometry> ShapeReader::mesh(const XmlNode& node, const Source& source) {
  const XmlNode* const uri = first_of(node, {"uri", "filename"});
  if (uri == nullptr || uri->content().empty()) {
    elements_.error("sdf.value", node.where, "this <mesh> has no <uri>");
    return std::nullopt;
  }
  MeshGeometry out;
  out.uri = uri->content();
  out.scale = elements_.vector<3>(node, "scale").value_or(out.scale);
  out.path = files_.find(out.uri, source.folder, uri->where);
  if (const XmlNode* const part = node.first("submesh")) {
    out.submesh = Elements::text(*part, "name");
    out.center_submesh = elements_.truth(*part, "center", false);
  }
  return out;
}

// Gazebo's look of a visual: the diffuse colour, else that of the script's name.
std::optional<Material> ShapeReader::material(const XmlNode& visual, const Source& source) {
  const XmlNode* const node = visual.first("material");
  const double transparency = std::clamp(elements_.number_or(visual, "transparency", 0), 0.0, 1.0);
  if (node == nullptr && transparency == 0) return std::nullopt;
  Material out;
  if (node != nullptr) {
    elements_.check(*node, "material");
    out.source = node->where;
    for (const char* name : {"diffuse", "ambient", "emissive"}) {
      if (!out.rgba) out.rgba = elements_.colour(*node, name);
    }
    if (const XmlNode* const script = node->first("script")) named_material(*script, source, out);
    out.emissive = elements_.colour(*node, "emissive");
    if (const XmlNode* const pbr = node->first("pbr")) physical_material(*pbr, source, out);
  }
  if (transparency > 0) {
    Eigen::Vector4d rgba = out.rgba.value_or(Eigen::Vector4d(0.7, 0.7, 0.7, 1));
    rgba.w() *= 1 - transparency;
    out.rgba = rgba;
  }
  return out;
}

Image ShapeReader::image(const XmlNode& parent, const char* name, const Source& source) {
  const XmlNode* const node = parent.first(name);
  if (node == nullptr || node->content().empty()) return {};
  return {node->content(), files_.find(node->content(), source.folder, node->where)};
}

// The metal workflow, or the specular one, whose glossiness is the complement of the roughness.
void ShapeReader::physical_material(const XmlNode& pbr, const Source& source, Material& out) {
  const XmlNode* const node = first_of(pbr, {"metal", "specular"});
  if (node == nullptr) return;
  elements_.check(*node, node->name);
  const Image albedo = image(*node, "albedo_map", source);
  if (!albedo.uri.empty()) {
    out.texture = albedo.uri;
    out.texture_path = albedo.path;
    if (!out.rgba) out.rgba = Eigen::Vector4d::Ones();
  }
  const auto part = [](std::optional<double> value) {
    return value ? std::optional(std::clamp(*value, 0.0, 1.0)) : value;
  };
  out.normal_map = image(*node, "normal_map", source);
  out.emissive_map = image(*node, "emissive_map", source);
  if (node->is("metal")) {
    out.roughness = part(elements_.number(*node, "roughness"));
    out.metalness = part(elements_.number(*node, "metalness"));
    out.roughness_map = image(*node, "roughness_map", source);
    out.metalness_map = image(*node, "metalness_map", source);
  } else if (const auto glossiness = part(elements_.number(*node, "glossiness"))) {
    out.roughness = 1 - *glossiness;
  }
}

void ShapeReader::named_material(const XmlNode& script, const Source& source, Material& out) {
  out.name = Elements::text(script, "name");
  if (out.name.empty()) out.name = script.content();  // of SDF 1.3: <script>Gazebo/Grey</script>
  if (out.name.empty()) return;
  std::vector<std::string> uris;
  for (const XmlNode& child : script.children) {
    if (child.is("uri")) uris.push_back(child.content());
  }
  if (const auto scripted = scripts_.find(out.name, uris, source.folder)) {
    out.texture = scripted->texture;
    out.texture_path = scripted->texture_path;
    // The colour multiplies the texture; scripts without one are white.
    if (!out.texture_path.empty() || !out.rgba)
      out.rgba = scripted->diffuse.value_or(Eigen::Vector4d::Ones());
    return;
  }
  std::optional<Eigen::Vector4d> rgba = gazebo_colour(out.name);
  if (!rgba) rgba = gazebo_colour("Gazebo/" + out.name);
  if (!out.rgba) out.rgba = rgba;
  if (rgba || out.rgba) return;
  const auto nearest =
      out.name.starts_with("Gazebo/") ? nearest_name(out.name, gazebo_colour_names()) : std::nullopt;
  elements_.diagnostics.note(
      "sdf.material", script.where,
      fmt::format("the material '{}' is not one of Gazebo's; the shape is drawn grey{}", out.name,
                  nearest ? "; did you mean '" + *nearest + "'?" : ""),
      "write a <diffuse> colour");
  out.rgba = gazebo_colour("Gazebo/Grey");
}

void ShapeReader::friction(const XmlNode& friction, ContactSurface& out) {
  elements_.check(friction, "friction");
  read_friction(
      friction,
      {[this](const XmlNode& parent, std::string_view name) { return elements_.number(parent, name); },
       [this](const XmlNode& parent, std::string_view name) -> std::optional<Eigen::Vector3d> {
         return elements_.vector<3>(parent, name);
       }},
      out);
  const XmlNode* const torsional = friction.first("torsional");
  if (torsional == nullptr || elements_.truth(*torsional, "use_patch_radius", true)) return;
  out.patch_radius.reset();
  elements_.without_effect(torsional->where, "<surface_radius> of a <torsional>");
}

void ShapeReader::contact(const XmlNode& contact, ContactSurface& out) {
  if (const XmlNode* const ode = contact.first("ode")) {
    out.kp = elements_.number(*ode, "kp");
    out.kd = elements_.number(*ode, "kd");
    out.max_velocity = elements_.number(*ode, "max_vel");
    out.min_depth = elements_.number(*ode, "min_depth");
  }
  if (const XmlNode* const mask = contact.first("collide_bitmask"))
    elements_.without_effect(mask->where, "<collide_bitmask>");
}

ContactSurface ShapeReader::surface(const XmlNode& collision) {
  ContactSurface out;
  out.mu = kSdfFriction;
  const XmlNode* const node = collision.first("surface");
  if (node == nullptr) return out;
  elements_.check(*node, "surface");
  if (const XmlNode* const written = node->first("friction")) friction(*written, out);
  if (!out.mu || !(*out.mu >= 0)) out.mu = kSdfFriction;
  if (const XmlNode* const written = node->first("contact")) contact(*written, out);
  if (const XmlNode* const bounce = node->first("bounce")) {
    out.restitution = elements_.number(*bounce, "restitution_coefficient");
    const XmlNode* const threshold = bounce->first("threshold");
    if (threshold != nullptr && out.restitution.value_or(0.0) > 0)
      elements_.without_effect(threshold->where, "<threshold> of a <bounce>");
  }
  return out;
}

std::optional<Inertial> ShapeReader::inertial(const XmlNode& link, const Link& shapes, const Pose& X_LI) {
  const XmlNode* const node = link.first("inertial");
  Inertial out;
  out.mass = 1.0;  // SDF's default
  out.source = node == nullptr ? link.where : node->where;
  out.tensor_written = false;
  if (node == nullptr) {
    elements_.without_effect(link.where, "a missing <inertial>",
                             "SDF's mass of 1 kg is taken, with the moments of the link's shapes");
    out.origin.xyz = link_solid(shapes).com;
    return out;
  }
  elements_.check(*node, "inertial");
  out.origin = origin_of(X_LI, node->where);
  const std::string automatic = Elements::attribute(*node, "auto");
  if (automatic == "true" || automatic == "1") {
    MassProperties sum;
    const double fallback = elements_.number_or(*node, "density", kAssumedDensity);
    for (const XmlNode& child : link.children) {
      if (child.is("collision")) add_density(child, shapes, fallback, sum);
    }
    const std::optional<double> mass = elements_.number(*node, "mass");
    if (mass && sum.mass > 0) sum.I *= *mass / sum.mass;
    if (mass && *mass > 0) sum.mass = *mass;
    if (!(sum.mass > 0)) return out;  // without a collision: SDF's default
    out.tensor_written = true;
    out.origin = origin_of(Pose(Eigen::Translation3d(sum.com)), node->where);
    out.mass = sum.mass;
    out.ixx = sum.I(0, 0), out.ixy = sum.I(0, 1), out.ixz = sum.I(0, 2);
    out.iyy = sum.I(1, 1), out.iyz = sum.I(1, 2), out.izz = sum.I(2, 2);
    out.source = node->where;
    return out;
  }
  out.mass = elements_.number_or(*node, "mass", 1.0);
  const XmlNode* const tensor = node->first("inertia");
  if (tensor == nullptr) return out;
  elements_.check(*tensor, "inertia");
  out.tensor_written = true;
  const std::pair<const char*, double*> moments[] = {{"ixx", &out.ixx}, {"iyy", &out.iyy}, {"izz", &out.izz}};
  for (const auto& [name, value] : moments) *value = elements_.number_or(*tensor, name, 1.0);
  const std::pair<const char*, double*> products[] = {
      {"ixy", &out.ixy}, {"ixz", &out.ixz}, {"iyz", &out.iyz}};
  for (const auto& [name, value] : products) *value = elements_.number_or(*tensor, name, 0.0);
  return out;
}

// The solids of the <collision>, which are among those of the link, at its own density.
void ShapeReader::add_density(const XmlNode& collision, const Link& shapes, double fallback,
                              MassProperties& sum) {
  const double density = elements_.number_or(collision, "density", fallback);
  for (const Collision& part : shapes.collisions) {
    if (part.source.line != collision.where.line || part.source.column != collision.where.column) continue;
    const MassProperties solid = shape_solid(part.geometry, density);
    if (solid.mass > 0) sum = combined(sum, transformed(solid, part.origin.pose()));
  }
}

}  // namespace doppel::sdf
