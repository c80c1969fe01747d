#include "doppel/review/conversion/urdf.h"

#include <map>

#include "doppel/base/xml/xml.h"

namespace doppel {
namespace {

void note_meshes(const Geometry& geometry, std::map<std::string, const MeshGeometry*>& by_uri) {
  if (const auto* mesh = std::get_if<MeshGeometry>(&geometry)) by_uri.emplace(mesh->uri, mesh);
}

// Elements that doppel does not use are kept; only the names of mesh files change.
void rename_meshes(XmlNode& node, const std::map<std::string, const MeshGeometry*>& by_uri,
                   MeshFiles& meshes) {
  if (node.is("mesh")) {
    for (XmlAttribute& attribute : node.attributes) {
      const auto found = attribute.name == "filename" ? by_uri.find(attribute.value) : by_uri.end();
      if (found != by_uri.end()) attribute.value = meshes.reference(*found->second);
    }
  }
  for (XmlNode& child : node.children) rename_meshes(child, by_uri, meshes);
}

}  // namespace

std::string to_urdf(const RobotDescription& robot, MeshFiles& meshes) {
  std::map<std::string, const MeshGeometry*> by_uri;
  for (const Link& link : robot.links) {
    for (const Visual& visual : link.visuals) note_meshes(visual.geometry, by_uri);
    for (const Collision& collision : link.collisions) note_meshes(collision.geometry, by_uri);
  }
  XmlNode root = parse_xml(robot.xml, robot.name);
  std::erase_if(root.attributes, [](const XmlAttribute& a) { return a.name == "xmlns:xacro"; });
  for (XmlNode& child : root.children) {
    if (child.is("link")) rename_meshes(child, by_uri, meshes);
  }
  return to_xml(root);
}

}  // namespace doppel
