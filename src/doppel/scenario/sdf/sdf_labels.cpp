#include "doppel/scenario/sdf/detail/sdf_labels.h"

#include <fmt/format.h>

#include "doppel/base/xml/element.h"
#include "doppel/description/gazebo/simulator_plugins.h"

namespace doppel::sdf {
namespace {

void copy_labels(const XmlNode& from, XmlNode& to, Elements& elements) {
  for (const XmlNode& plugin : from.children) {
    if (!plugin.is("plugin")) continue;
    const std::string filename = Elements::attribute(plugin, "filename"),
                      name = Elements::attribute(plugin, "name");
    if (is_label_plugin(filename, name)) {
      to.children.push_back(plugin);
      continue;
    }
    elements.without_effect(plugin.where,
                            fmt::format("the plugin '{}' of a <{}>",
                                        (filename.empty() ? name : filename).substr(0, 60), from.name),
                            "plugins of SDF are kept, but not loaded");
  }
}

}  // namespace

std::optional<GazeboExtension> labels_of(const XmlNode& link, const std::string& name, Elements& elements) {
  XmlNode gazebo = element("gazebo", {{"reference", name}});
  copy_labels(link, gazebo, elements);
  for (const XmlNode& child : link.children) {
    if (!child.is("visual")) continue;
    XmlNode visual = element("visual", {{"name", Elements::attribute(child, "name")}});
    copy_labels(child, visual, elements);
    if (!visual.children.empty()) gazebo.children.push_back(std::move(visual));
  }
  if (gazebo.children.empty()) return std::nullopt;
  GazeboExtension out;
  out.reference = name;
  out.xml = to_xml(gazebo);
  out.source = link.where;
  out.node = std::make_shared<const XmlNode>(std::move(gazebo));
  return out;
}

}  // namespace doppel::sdf
