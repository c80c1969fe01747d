#pragma once
// What the pixels of a picture of labels belong to: classes of Gazebo's Label plugin, their instances, and boxes around
// objects.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "doppel/base/math/pose.h"
#include "doppel/ros/messages/vision_msgs.h"
#include "doppel/sensors/models/lens.h"
#include "doppel/sensors/render/render_scene.h"

namespace doppel {

// Where a visual of the scene has a label, the class of a pixel is the label of its visual, and 0 where it has none; the
// visuals of a model with the same label are an object. In a scene without labels, each visual is a class of its own, up
// to kMostClasses, and each model but the ground an object.
class ObjectLabels {
 public:
  static constexpr std::uint32_t kMostClasses = 65535;  // of an image with 16 bits

  explicit ObjectLabels(std::shared_ptr<const RenderScene> scene);

  // -- of CameraPicture::labels
  [[nodiscard]] std::uint16_t class_of(std::uint32_t label) const { return classes_[label]; }
  // Below objects(); -1: nothing, or no object.
  [[nodiscard]] int object_of(std::uint32_t label) const { return object_of_[label]; }
  // The class of its object times 65,536, plus the number of the object among those of its class, from 1; 0: no object. In
  // a scene without labels the class of all objects is 1. Source: gz-rendering 8, Ogre2SegmentationMaterialSwitcher.cc.
  [[nodiscard]] std::uint32_t panoptic_of(std::uint32_t label) const;

  [[nodiscard]] std::size_t objects() const { return objects_.size(); }
  // The label, or in a scene without labels the name.
  [[nodiscard]] std::string class_id(std::size_t object) const;
  // Of its model; with the label, if the model has others.
  [[nodiscard]] std::string name(std::size_t object) const;
  [[nodiscard]] const RenderScene& scene() const { return *scene_; }

  // The axes of its box: of its visual, if it has one, else of the link of the first one.
  struct Axes {
    int body = 0;
    Pose X_BA = Pose::Identity();
  };
  [[nodiscard]] const Axes& axes(std::size_t object) const { return objects_[object].axes; }

 private:
  struct Object {
    int model;
    std::optional<std::uint16_t> label;
    std::uint32_t panoptic = 0;
    Axes axes = {};
  };

  std::shared_ptr<const RenderScene> scene_;
  std::vector<Object> objects_;
  std::vector<std::uint16_t> classes_;  // [labels]
  std::vector<int> object_of_;
};

// True if classes of the scene's visuals do not suffice: it has no labels, and more of them than kMostClasses.
bool lacks_classes(const RenderScene& scene);

// Around the visible pixels of each object. With `full`, around all of a visible object as far as it is in the picture,
// also where something is before it. `bodies`: X_WB of all bodies of the scene.
std::vector<vision_msgs::msg::Detection2D> boxes_of(const ObjectLabels& objects,
                                                    std::span<const std::uint32_t> labels,
                                                    const CameraIntrinsics& camera, bool full,
                                                    std::span<const Pose> bodies, const Pose& X_WC);

// Around all vertices of each visible object, in its axes. X_FW: of the frame F in which the boxes are.
std::vector<vision_msgs::msg::Detection3D> oriented_boxes_of(const ObjectLabels& objects,
                                                             std::span<const std::uint32_t> labels,
                                                             std::span<const Pose> bodies, const Pose& X_FW);

}  // namespace doppel
