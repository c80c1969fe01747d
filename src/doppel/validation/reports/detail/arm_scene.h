#pragma once
// An arm in configurations, for a report: the data that a script draws, and a drawing without a script.

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "doppel/base/math/pose.h"
#include "doppel/validation/checks/check.h"
#include "doppel/validation/checks/subject.h"
#include "doppel/validation/reports/detail/link_surfaces.h"

namespace doppel {

// The sphere around the arm, and the direction from which it is seen.
struct ArmView {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // m, in the root's frame
  double radius = 1;                                 // m
  double yaw = 0, pitch = 0.4;                       // rad: of the direction to the eye
};

struct ArmPose {
  std::vector<Pose> X_WL;  // of the scene's links
  std::vector<int> named;  // indices into the scene's links
  ArmView view;
};

class ArmScene {
 public:
  // `poses`: the number of drawings; the more, the coarser. Precondition: the subject has a machine.
  ArmScene(const Subject& subject, std::size_t poses);

  [[nodiscard]] bool is_empty() const { return fine_.empty(); }
  [[nodiscard]] ArmPose pose(const PosedEvidence& evidence) const;
  // An SVG: the named links are coloured and have outlines and names.
  [[nodiscard]] std::string drawing(const ArmPose& pose, const std::string& caption) const;
  // JSON: links with base64 of 16-bit corners and triangles, and the poses.
  [[nodiscard]] std::string data(const std::vector<ArmPose>& poses) const;

 private:
  [[nodiscard]] ArmView view_of(const ArmPose& pose) const;

  std::shared_ptr<const Model> model_;
  std::vector<LinkSurface> fine_, coarse_;  // the same links
};

}  // namespace doppel
