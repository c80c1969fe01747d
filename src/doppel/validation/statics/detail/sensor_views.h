#pragma once
// What sensors of light see of places while the robot itself, objects of its world and the ground may hide
// them.

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/sensors/render/ray_caster.h"
#include "doppel/validation/checks/subject.h"
#include "doppel/validation/statics/detail/sensor_fields.h"

namespace doppel {

struct SeenPlace {
  PlaceSight sight = PlaceSight::seen;
  std::int32_t hider = -1;  // the body of the scene that hides it
  float distance = 0;       // m from the sensor to that body
};

// The visuals of the links, each link a body, then the ground and what stands in the world, where it starts.
struct SensorScene {
  std::shared_ptr<const RenderScene> scene;
  std::vector<Pose> X_RB;          // of the bodies behind the links, in the root link
  std::vector<std::string> names;  // [bodies] "link 'wrist'", "object 'table'", "the ground"
};
// What cannot be read is a warning.
[[nodiscard]] SensorScene sensor_scene(const Subject& subject, Diagnostics& warnings);

// For one thread. A sensor's housing hides nothing nearer than the sensor's own least distance: the link that
// carries it, or, where that has no visuals, the next one above it that is fixed to it.
class SensorViews {
 public:
  // Throws std::runtime_error: rays cannot be cast, because Embree is missing.
  SensorViews(const Model& model, const SensorScene& scene, std::span<const SensorField> fields);

  // [fields][places]. Places: m, root link.
  std::vector<std::vector<SeenPlace>> look(const Eigen::VectorXd& q, std::span<const Eigen::Vector3d> places,
                                           double radius);
  // After look(): a link in the root link.
  [[nodiscard]] const Pose& link_pose(int link) const { return data_.X_WL[static_cast<std::size_t>(link)]; }

 private:
  // The robot in two parts.
  struct Parts {
    std::unique_ptr<RayCaster> housing, others;
  };
  void hide(const SensorField& field, const Parts& parts, std::span<const Eigen::Vector3d> places,
            std::vector<SeenPlace>& out) const;

  const Model& model_;
  std::vector<Pose> X_RB_;  // [bodies]
  std::span<const SensorField> fields_;
  std::vector<int> housings_;   // [fields] links, -1: none
  std::map<int, Parts> parts_;  // by housing
  Data data_;
};

}  // namespace doppel
