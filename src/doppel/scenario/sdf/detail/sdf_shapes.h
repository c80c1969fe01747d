#pragma once
// Visuals, collisions and inertials of a link.

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/math/mass_properties.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/scenario/sdf/detail/material_script.h"
#include "doppel/scenario/sdf/detail/model_search.h"
#include "doppel/scenario/sdf/detail/sdf_elements.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel::sdf {

// The file of a mesh or texture; empty: not found, which is reported once for each URI.
class Files {
 public:
  // `search` nullptr: nothing is searched.
  Files(ModelSearch* search, Diagnostics& diagnostics) : search_(search), diagnostics_(diagnostics) {}
  // Files other than models by a function that throws InputError, which becomes an error at the URI's place.
  Files(SdfMeshFinder finder, Diagnostics& diagnostics)
      : search_(nullptr), finder_(std::move(finder)), diagnostics_(diagnostics) {}
  std::string find(const std::string& uri, const std::filesystem::path& folder, const SourceLocation& where);
  [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }
  void add_missing(const std::string& uri);
  [[nodiscard]] ModelSearch* search() const { return search_; }

 private:
  ModelSearch* search_;
  SdfMeshFinder finder_;
  Diagnostics& diagnostics_;
  std::vector<std::string> missing_;
};

// The colour of a material's name ("Gazebo/Orange"), with or without "Gazebo/".
std::optional<Eigen::Vector4d> gazebo_colour(const std::string& name);
std::vector<std::string> gazebo_colour_names();

// One shape, or several for an outline that is not convex; none: it is reported. Poses are the geometry's in the
// <visual> or <collision>.
struct PlacedGeometry {
  Geometry geometry;
  Pose X = Pose::Identity();
};

class ShapeReader {
 public:
  ShapeReader(Elements& elements, Files& files)
      : elements_(elements), files_(files), scripts_(files.search()) {}

  // X_L: the pose of the <visual> or <collision> in the link, because its frame may be any of the model.
  std::vector<Visual> visuals(const XmlNode& node, const Pose& X_L, const Source& source);
  std::vector<Collision> collisions(const XmlNode& node, const Pose& X_L, const Source& source);
  // X_LI: the pose of <inertial> in the link. nullopt: the link has no mass properties of its own.
  std::optional<Inertial> inertial(const XmlNode& link, const Link& shapes, const Pose& X_LI);

 private:
  std::vector<PlacedGeometry> geometry(const XmlNode& parent, const Source& source);
  std::vector<PlacedGeometry> shape(const XmlNode& node, const Source& source);
  std::vector<PlacedGeometry> polyline(const XmlNode& node);
  std::optional<Geometry> mesh(const XmlNode& node, const Source& source);
  std::optional<PlacedGeometry> heightmap(const XmlNode& node, const Source& source);
  // nullptr: not found, or not readable, which is reported once for each image.
  std::shared_ptr<const HeightField> field_of(const Heightmap& map, const SourceLocation& where);
  double size(const XmlNode& node, const char* name);
  std::optional<Material> material(const XmlNode& visual, const Source& source);
  void named_material(const XmlNode& script, const Source& source, Material& out);
  void physical_material(const XmlNode& pbr, const Source& source, Material& out);
  Image image(const XmlNode& parent, const char* name, const Source& source);
  ContactSurface surface(const XmlNode& collision);
  void friction(const XmlNode& friction, ContactSurface& out);
  void contact(const XmlNode& contact, ContactSurface& out);
  void add_density(const XmlNode& collision, const Link& shapes, double fallback, MassProperties& sum);

  Elements& elements_;
  Files& files_;
  MaterialScripts scripts_;
  std::map<std::string, std::shared_ptr<const HeightField>> fields_;  // by path and size
};

}  // namespace doppel::sdf
