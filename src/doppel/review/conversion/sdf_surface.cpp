#include "doppel/review/conversion/detail/sdf_surface.h"

#include "doppel/base/math/decimals.h"
#include "doppel/base/xml/element.h"

namespace doppel {
namespace {

constexpr double kSdfDefaultFriction = 1.0;  // mu and mu2 of a collision without a <surface>

std::string rgba_text(const Eigen::Vector4d& rgba) {
  return decimals(rgba.head<3>()) + " " + decimal(rgba.w());
}

void add_number(const std::optional<double>& value, const char* name, XmlNode& out) {
  if (value) out.children.push_back(text_element(name, decimal(*value)));
}

void add_filled(XmlNode&& part, XmlNode& out) {
  if (!part.children.empty()) out.children.push_back(std::move(part));
}

XmlNode friction_of(const ContactSurface& surface) {
  XmlNode ode = element("ode");
  if (surface.mu != kSdfDefaultFriction || surface.mu2) add_number(surface.mu, "mu", ode);
  // Without mu2, mu holds in every direction; SDF would assume 1.
  const bool same = !surface.mu2 && surface.mu != kSdfDefaultFriction;
  add_number(same ? surface.mu : surface.mu2, "mu2", ode);
  if (surface.fdir1) ode.children.push_back(text_element("fdir1", decimals(*surface.fdir1)));
  add_number(surface.slip1, "slip1", ode);
  add_number(surface.slip2, "slip2", ode);
  XmlNode torsional = element("torsional");
  add_number(surface.torsional_mu, "coefficient", torsional);
  add_number(surface.patch_radius, "patch_radius", torsional);
  XmlNode out = element("friction");
  add_filled(std::move(ode), out);
  add_filled(std::move(torsional), out);
  return out;
}

void add_map(const Image& image, const char* name, MeshFiles& files, XmlNode& out) {
  if (image.uri.empty()) return;
  out.children.push_back(
      text_element(name, files.reference(MeshGeometry{image.uri, Eigen::Vector3d::Ones(), image.path})));
}

}  // namespace

XmlNode sdf_heightmap(const Heightmap& map, MeshFiles& files) {
  XmlNode out = element("heightmap");
  add_map(map.image, "uri", files, out);
  out.children.push_back(text_element("size", decimals(map.size)));
  for (const Heightmap::Texture& texture : map.textures) {
    XmlNode layer = element("texture", {}, {text_element("size", decimal(texture.size))});
    add_map(texture.diffuse, "diffuse", files, layer);
    add_map(texture.normal, "normal", files, layer);
    out.children.push_back(std::move(layer));
  }
  for (const Heightmap::Blend& blend : map.blends) {
    out.children.push_back(element("blend", {},
                                   {text_element("min_height", decimal(blend.height)),
                                    text_element("fade_dist", decimal(blend.distance))}));
  }
  return out;
}

std::optional<XmlNode> sdf_surface(const ContactSurface& surface) {
  XmlNode out = element("surface");
  add_filled(friction_of(surface), out);
  XmlNode bounce = element("bounce");
  add_number(surface.restitution, "restitution_coefficient", bounce);
  add_filled(std::move(bounce), out);
  XmlNode ode = element("ode"), contact = element("contact");
  add_number(surface.kp, "kp", ode);
  add_number(surface.kd, "kd", ode);
  add_number(surface.max_velocity, "max_vel", ode);
  add_number(surface.min_depth, "min_depth", ode);
  add_filled(std::move(ode), contact);
  add_filled(std::move(contact), out);
  if (out.children.empty()) return std::nullopt;
  return out;
}

std::optional<XmlNode> sdf_material(const Material& material, MeshFiles& files) {
  if (!material.rgba && material.texture_path.empty()) return std::nullopt;
  const std::string colour = rgba_text(material.rgba.value_or(Eigen::Vector4d::Ones()));
  XmlNode out = element("material", {}, {text_element("ambient", colour), text_element("diffuse", colour)});
  out.children.push_back(text_element("specular", "0.1 0.1 0.1 1"));
  if (material.emissive) out.children.push_back(text_element("emissive", rgba_text(*material.emissive)));
  XmlNode metal = element("metal");
  if (!material.texture_path.empty())
    add_map({material.texture, material.texture_path}, "albedo_map", files, metal);
  add_map(material.normal_map, "normal_map", files, metal);
  add_map(material.emissive_map, "emissive_map", files, metal);
  add_map(material.roughness_map, "roughness_map", files, metal);
  add_map(material.metalness_map, "metalness_map", files, metal);
  add_number(material.roughness, "roughness", metal);
  add_number(material.metalness, "metalness", metal);
  if (!metal.children.empty()) out.children.push_back(element("pbr", {}, {std::move(metal)}));
  return out;
}

}  // namespace doppel
