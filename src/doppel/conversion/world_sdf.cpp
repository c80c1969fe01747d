#include <algorithm>

#include "doppel/conversion/detail/unique_name.h"
#include "doppel/conversion/sdf.h"
#include "doppel/conversion/world_documents.h"
#include "doppel/math/decimals.h"
#include "doppel/xml/element.h"

namespace doppel {
namespace {

XmlNode sdf_ground(const SdfWorld& world) {
  std::vector<std::string> taken{"ground"};
  for (const SdfModel& model : world.models) taken.push_back(model.name);
  const std::string mu = decimal(world.settings.ground_friction);
  XmlNode friction = element(
      "surface", {},
      {element("friction", {}, {element("ode", {}, {text_element("mu", mu), text_element("mu2", mu)})})});
  XmlNode collision =
      element("collision", {{"name", "collision"}},
              {element("geometry", {}, {element("plane", {}, {text_element("normal", "0 0 1")})}),
               std::move(friction)});
  return element(
      "model", {{"name", unique_name("ground_plane", taken)}},
      {text_element("static", "true"), element("link", {{"name", "link"}}, {std::move(collision)})});
}

}  // namespace

std::string to_world_sdf(const SdfWorld& world, MeshFiles& meshes, Diagnostics& diagnostics) {
  const WorldSettings& settings = world.settings;
  XmlNode out = element("world", {{"name", settings.name}});
  out.children.push_back(text_element("gravity", decimals(settings.gravity)));
  out.children.push_back(element("physics", {{"type", "ode"}, {"name", "default"}},
                                 {text_element("max_step_size", decimal(to_seconds(settings.step)))}));
  if (settings.ground) out.children.push_back(sdf_ground(world));
  for (const SdfModel& model : world.models) {
    const Model compiled = compile_model(*model.description, BaseKind::fixed, diagnostics);
    XmlNode root = parse_xml(to_sdf(*model.description, compiled, meshes, diagnostics), model.name);
    for (XmlNode& child : root.children) {
      if (!child.is("model")) continue;
      for (auto& attribute : child.attributes) {
        if (attribute.name == "name") attribute.value = model.name;
      }
      const Eigen::Vector3d rpy = rpy_from_rotation(model.X_WR.linear());
      child.children.insert(child.children.begin(),
                            text_element("pose", decimals(model.X_WR.translation()) + " " + decimals(rpy)));
      if (model.is_static) child.children.insert(child.children.begin(), text_element("static", "true"));
      out.children.push_back(std::move(child));
    }
  }
  return to_xml(element("sdf", {{"version", "1.11"}}, {std::move(out)}));
}

}  // namespace doppel
