#pragma once
// What the pixels of a picture of labels belong to: classes of Gazebo's Label plugin, and boxes around objects.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "doppel/math/pose.h"
#include "doppel/messages/vision_msgs.h"
#include "doppel/scene/render_scene.h"
#include "doppel/sensors/lens.h"

namespace doppel {

// Where a model of the scene has a label, the class of a pixel is the label of its model, and 0 where it has none. In a
// scene without labels, each visual is a class of its own, and each model but the ground an object.
class ObjectLabels {
 public:
  explicit ObjectLabels(const RenderScene& scene);

  // -- of CameraPicture::labels
  [[nodiscard]] std::uint16_t class_of(std::uint32_t label) const { return classes_[label]; }
  // Into RenderScene::models; -1: nothing, or no object.
  [[nodiscard]] int object_of(std::uint32_t label) const { return objects_[label]; }

  // The label, or in a scene without labels the name.
  [[nodiscard]] std::string class_id(int object) const;

 private:
  const RenderScene& scene_;
  bool labelled_ = false;
  std::vector<std::uint16_t> classes_;
  std::vector<int> objects_;
};

// Around the visible pixels of each object. With `full`, around all of a visible object as far as it is in the picture,
// also where something is before it. `bodies`: X_WB of all bodies of the scene.
std::vector<vision_msgs::msg::Detection2D> boxes_of(const RenderScene& scene,
                                                    std::span<const std::uint32_t> labels,
                                                    const CameraIntrinsics& camera, bool full,
                                                    std::span<const Pose> bodies, const Pose& X_WC);

}  // namespace doppel
