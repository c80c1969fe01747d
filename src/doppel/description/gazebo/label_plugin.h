#pragma once
// Gazebo's Label plugin: the classes of a model's visuals in pictures of labels and boxes. Source: gz-sim 8,
// systems/label, which is a plugin of models and visuals; here it may be in links, too.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// The labels of a link's visuals, from 1 to 255. The plugin of the visual counts, else that of its link, else that of
// the model. A URDF has them in <gazebo>, in <gazebo reference="link">, and in <visual> of the latter, where they are
// of all visuals of the link, or with the attribute `name` of the visuals of that name.
class DOPPEL_API VisualLabels {
 public:
  // A value that cannot be read is a warning ("sensor.value") and counts as not written.
  VisualLabels(const RobotDescription& robot, Diagnostics& diagnostics);
  // [visuals]; nullopt: it has none, or 0, which is the background.
  [[nodiscard]] std::vector<std::optional<std::uint16_t>> of(const Link& link) const;

 private:
  enum class Place { model, link, visuals, visual };  // visuals: all of a link
  struct Written {
    Place place;
    std::string link, visual;
    std::uint16_t value;
  };
  std::vector<Written> labels_;  // in the order of the file; of several in the same place, the first counts
};

}  // namespace doppel
