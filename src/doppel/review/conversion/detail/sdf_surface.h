#pragma once
// The appearance and contact of a shape in SDF: <material>, <surface> and <heightmap>.

#include <optional>

#include "doppel/base/xml/xml.h"
#include "doppel/review/conversion/mesh_files.h"

namespace doppel {

// nullopt: neither a colour nor a texture.
std::optional<XmlNode> sdf_material(const Material& material, MeshFiles& files);
// nullopt: nothing that SDF does not assume anyway.
std::optional<XmlNode> sdf_surface(const ContactSurface& surface);

XmlNode sdf_heightmap(const Heightmap& map, MeshFiles& files);

}  // namespace doppel
