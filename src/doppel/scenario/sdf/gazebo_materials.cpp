// The colours of Gazebo's named materials. Source: Gazebo classic's gazebo.material (diffuse colours); a material
// that is a texture has about its mean colour.
#include <algorithm>
#include <iterator>
#include <string_view>

#include "doppel/scenario/sdf/detail/sdf_shapes.h"

namespace doppel::sdf {
namespace {

struct NamedColour {
  std::string_view name;
  double red, green, blue, opacity;
};

// The colours by name.
constexpr NamedColour kColours[] = {
    {"Gazebo/Black", 0, 0, 0, 1},
    {"Gazebo/BlackTransparent", 0, 0, 0, 0.5},
    {"Gazebo/Blue", 0, 0, 1, 1},
    {"Gazebo/BlueGlow", 0, 0, 1, 1},
    {"Gazebo/BlueLaser", 0, 0, 1, 0.4},
    {"Gazebo/BlueTransparent", 0, 0, 1, 0.5},
    {"Gazebo/BlueTransparentOverlay", 0, 0, 1, 0.5},
    {"Gazebo/Bricks", 0.6, 0.32, 0.25, 1},
    {"Gazebo/BuildingFrame", 0.7, 0.7, 0.7, 1},
    {"Gazebo/CeilingTiled", 0.82, 0.82, 0.8, 1},
    {"Gazebo/CloudySky", 0.6, 0.7, 0.85, 1},
    {"Gazebo/CoM", 0.8, 0.8, 0.2, 1},
    {"Gazebo/DarkGray", 0.175, 0.175, 0.175, 1},
    {"Gazebo/DarkGrey", 0.175, 0.175, 0.175, 1},
    {"Gazebo/DarkMagentaTransparent", 0.6, 0, 0.6, 0.5},
    {"Gazebo/DarkOrangeTransparentOverlay", 0.6, 0.305, 0.028, 0.8},
    {"Gazebo/DarkYellow", 0.7, 0.7, 0, 1},
    {"Gazebo/Editor", 1, 1, 1, 1},
    {"Gazebo/EditorPlane", 0.7, 0.7, 0.7, 1},
    {"Gazebo/FlatBlack", 0.1, 0.1, 0.1, 1},
    {"Gazebo/Footway", 0.6, 0.6, 0.58, 1},
    {"Gazebo/Gold", 0.8, 0.649, 0.121, 1},
    {"Gazebo/Grass", 0.3, 0.45, 0.2, 1},
    {"Gazebo/Gray", 0.7, 0.7, 0.7, 1},
    {"Gazebo/Green", 0, 1, 0, 1},
    {"Gazebo/GreenGlow", 0, 1, 0, 1},
    {"Gazebo/GreenTransparent", 0, 1, 0, 0.5},
    {"Gazebo/GreenTransparentOverlay", 0, 1, 0, 0.5},
    {"Gazebo/Grey", 0.7, 0.7, 0.7, 1},
    {"Gazebo/GreyGradientSky", 0.6, 0.6, 0.6, 1},
    {"Gazebo/GreyTransparent", 0.5, 0.5, 0.5, 0.5},
    {"Gazebo/Indigo", 0.33, 0, 0.5, 1},
    {"Gazebo/JointAnchor", 1, 1, 1, 1},
    {"Gazebo/Lane_1", 0.34, 0.34, 0.34, 1},
    {"Gazebo/Lanes_2", 0.33, 0.33, 0.33, 1},
    {"Gazebo/Lanes_4", 0.32, 0.32, 0.32, 1},
    {"Gazebo/Lanes_6", 0.3, 0.3, 0.3, 1},
    {"Gazebo/LightBlueLaser", 0.5, 0.5, 1, 0.4},
    {"Gazebo/LightOff", 1, 0, 0, 1},
    {"Gazebo/LightOn", 0, 1, 0, 1},
    {"Gazebo/Motorway", 0.3, 0.3, 0.3, 1},
    {"Gazebo/Orange", 1, 0.509, 0.047, 1},
    {"Gazebo/OrangeTransparent", 1, 0.44, 0, 0.4},
    {"Gazebo/OrangeTransparentOverlay", 1, 0.509, 0.047, 0.8},
    {"Gazebo/PaintedWall", 0.8, 0.78, 0.72, 1},
    {"Gazebo/Pedestrian", 0.6, 0.6, 0.58, 1},
    {"Gazebo/Pioneer2Body", 0.681, 0.001, 0.001, 1},
    {"Gazebo/PioneerBody", 0.7, 0.05, 0.05, 1},
    {"Gazebo/Primary", 0.33, 0.33, 0.33, 1},
    {"Gazebo/Purple", 1, 0, 1, 1},
    {"Gazebo/PurpleGlow", 1, 0, 1, 1},
    {"Gazebo/Red", 1, 0, 0, 1},
    {"Gazebo/RedBright", 0.87, 0.26, 0.07, 1},
    {"Gazebo/RedGlow", 1, 0, 0, 1},
    {"Gazebo/RedTransparent", 1, 0, 0, 0.5},
    {"Gazebo/RedTransparentOverlay", 1, 0, 0, 0.5},
    {"Gazebo/Residential", 0.35, 0.35, 0.35, 1},
    {"Gazebo/Road", 0.35, 0.35, 0.35, 1},
    {"Gazebo/Runway", 0.35, 0.35, 0.36, 1},
    {"Gazebo/Secondary", 0.34, 0.34, 0.34, 1},
    {"Gazebo/SkyBlue", 0.13, 0.44, 0.7, 1},
    {"Gazebo/Steps", 0.55, 0.55, 0.52, 1},
    {"Gazebo/Tertiary", 0.35, 0.35, 0.35, 1},
    {"Gazebo/Trunk", 0.32, 0.32, 0.32, 1},
    {"Gazebo/Turquoise", 0, 1, 1, 1},
    {"Gazebo/TurquoiseGlow", 0, 1, 1, 1},
    {"Gazebo/TurquoiseGlowOutline", 0, 1, 1, 1},
    {"Gazebo/White", 1, 1, 1, 1},
    {"Gazebo/WhiteGlow", 1, 1, 1, 1},
    {"Gazebo/WindowFrame", 0.75, 0.75, 0.75, 1},
    {"Gazebo/Wood", 0.6, 0.42, 0.26, 1},
    {"Gazebo/WoodFloor", 0.62, 0.45, 0.3, 1},
    {"Gazebo/WoodPallet", 0.66, 0.52, 0.36, 1},
    {"Gazebo/Yellow", 1, 1, 0, 1},
    {"Gazebo/YellowGlow", 1, 1, 0, 1},
    {"Gazebo/YellowTransparent", 1, 1, 0, 0.5},
    {"Gazebo/ZincYellow", 0.973, 0.953, 0.208, 1},
};

}  // namespace

std::optional<Eigen::Vector4d> gazebo_colour(const std::string& name) {
  const auto* const found =
      std::lower_bound(std::begin(kColours), std::end(kColours), name,
                       [](const NamedColour& c, const std::string& n) { return c.name < n; });
  if (found == std::end(kColours) || found->name != name) return std::nullopt;
  return Eigen::Vector4d(found->red, found->green, found->blue, found->opacity);
}

std::vector<std::string> gazebo_colour_names() {
  std::vector<std::string> out;
  for (const NamedColour& colour : kColours) out.emplace_back(colour.name);
  return out;
}

}  // namespace doppel::sdf
