#include "doppel/validation/reports/detail/arm_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/validation/reports/detail/arm_drawing.h"

namespace doppel {
namespace {

constexpr std::size_t kFineTriangles = 24'000;                    // of the script's picture: 0.4 MB
constexpr std::size_t kDrawnTriangles = 40'000;                   // of all drawings
constexpr std::size_t kMinTriangles = 300, kMaxTriangles = 2400;  // of one drawing
constexpr int kViews = 12;                                        // that are compared

std::string base64(const std::vector<std::uint16_t>& words) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<unsigned> bytes;
  for (const std::uint16_t word : words) {
    bytes.push_back(word & 0xFFU);
    bytes.push_back(word >> 8U);
  }
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = bytes.size() - i;
    const unsigned block =
        bytes[i] << 16U | (left > 1 ? bytes[i + 1] << 8U : 0) | (left > 2 ? bytes[i + 2] : 0);
    for (std::size_t k = 0; k < 4; ++k) out += k <= left ? kDigits[block >> (18 - 6 * k) & 63U] : '=';
  }
  return out;
}

double rounded(double value) {
  return std::round(value * 1e5) / 1e5;
}

nlohmann::ordered_json surface_json(const LinkSurface& surface) {
  Eigen::Vector3f low = surface.vertices.front(), high = low;
  for (const Eigen::Vector3f& v : surface.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const Eigen::Vector3f size = (high - low).cwiseMax(1e-6F);
  std::vector<std::uint16_t> corners, triangles;
  for (const Eigen::Vector3f& v : surface.vertices) {
    for (int i = 0; i < 3; ++i)
      corners.push_back(static_cast<std::uint16_t>(std::lround(65535.0F * (v[i] - low[i]) / size[i])));
  }
  for (const auto& triangle : surface.triangles) {
    for (const std::uint32_t corner : triangle) triangles.push_back(static_cast<std::uint16_t>(corner));
  }
  return {{"name", surface.name},
          {"colour", {surface.colour.x(), surface.colour.y(), surface.colour.z()}},
          {"low", {low.x(), low.y(), low.z()}},
          {"size", {size.x(), size.y(), size.z()}},
          {"corners", base64(corners)},
          {"triangles", base64(triangles)}};
}

nlohmann::ordered_json pose_json(const ArmPose& pose) {
  nlohmann::ordered_json links = nlohmann::ordered_json::array();
  for (const Pose& X_WL : pose.X_WL) {
    nlohmann::ordered_json one = nlohmann::ordered_json::array();
    for (int column = 0; column < 4; ++column) {
      for (int row = 0; row < 3; ++row) one.push_back(rounded(X_WL.matrix()(row, column)));
    }
    links.push_back(one);
  }
  const ArmView& view = pose.view;
  return {{"links", links},
          {"named", pose.named},
          {"centre", {rounded(view.centre.x()), rounded(view.centre.y()), rounded(view.centre.z())}},
          {"radius", rounded(view.radius)},
          {"yaw", rounded(view.yaw)},
          {"pitch", rounded(view.pitch)}};
}

}  // namespace

ArmScene::ArmScene(const Subject& subject, std::size_t poses) : model_(subject.model) {
  const std::vector<LinkSurface> surfaces = link_surfaces(subject.description(), *model_);
  fine_ = simplified(surfaces, kFineTriangles);
  const std::size_t drawn = kDrawnTriangles / std::max<std::size_t>(poses, 1);
  coarse_ = simplified(fine_, std::clamp(drawn, kMinTriangles, kMaxTriangles));
}

ArmPose ArmScene::pose(const PosedEvidence& evidence) const {
  Eigen::VectorXd q = model_->neutral();
  for (const auto& [name, position] : evidence.joints) {
    const int joint = model_->find_joint(name);
    if (joint >= 0 && model_->joints[static_cast<std::size_t>(joint)].scalar() && std::isfinite(position))
      q[model_->joints[static_cast<std::size_t>(joint)].q] = position;
  }
  model_->apply_mimics(q);
  Data data(*model_);
  forward_kinematics(*model_, data, q);
  ArmPose out;
  for (std::size_t i = 0; i < fine_.size(); ++i) {
    out.X_WL.push_back(data.X_WL[static_cast<std::size_t>(fine_[i].link)]);
    if (std::ranges::find(evidence.links, fine_[i].name) != evidence.links.end())
      out.named.push_back(static_cast<int>(i));
  }
  out.view = view_of(out);
  return out;
}

// From where most of the named links is seen; without them obliquely from the front.
ArmView ArmScene::view_of(const ArmPose& pose) const {
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < coarse_.size(); ++i) {
    for (const Eigen::Vector3f& v : coarse_[i].vertices) box.extend(pose.X_WL[i] * v.cast<double>());
  }
  ArmView out;
  out.yaw = -std::numbers::pi / 4;
  if (box.isEmpty()) return out;
  out.centre = box.center();
  out.radius = std::max(0.5 * box.diagonal().norm(), 1e-3);
  if (pose.named.empty()) return out;
  double best = -1;
  for (int i = 0; i < kViews; ++i) {
    ArmView view = out;
    view.yaw += 2 * std::numbers::pi * i / kViews;
    const double share = visible_share(coarse_, pose, view);
    if (share <= best + 1e-9) continue;
    best = share;
    out.yaw = view.yaw;
  }
  return out;
}

std::string ArmScene::drawing(const ArmPose& pose, const std::string& caption) const {
  return arm_drawing(coarse_, pose, caption);
}

std::string ArmScene::data(const std::vector<ArmPose>& poses) const {
  nlohmann::ordered_json links = nlohmann::ordered_json::array(),
                         configurations = nlohmann::ordered_json::array();
  for (const LinkSurface& surface : fine_) links.push_back(surface_json(surface));
  for (const ArmPose& pose : poses) configurations.push_back(pose_json(pose));
  const nlohmann::ordered_json out{{"links", links}, {"poses", configurations}, {"colours", kNamedColours}};
  return out.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace doppel
