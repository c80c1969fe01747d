#pragma once
// The pose characteristics of ISO 9283:1998, clause 7: accuracy, repeatability, variation by direction,
// distance, drift, stabilisation, overshoot. S is the sample standard deviation (n - 1).
//
// Angles are those of the measured frame about three axes (a, b, c). An attained angle counts by its
// difference from the commanded one, which is taken within half a turn.

#include <Eigen/Core>
#include <optional>
#include <span>

#include "doppel/export.h"

namespace doppel {

struct MeasuredPose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m
  Eigen::Vector3d angles = Eigen::Vector3d::Zero();    // rad
};

// One commanded pose (7.2).
struct PoseFigures {
  MeasuredPose mean;                                              // the barycentre of the cloud
  double accuracy = 0;                                            // m: AP_P = |mean - commanded|
  Eigen::Vector3d axis_accuracy = Eigen::Vector3d::Zero();        // m: AP_x, AP_y, AP_z, signed
  Eigen::Vector3d angle_accuracy = Eigen::Vector3d::Zero();       // rad: AP_a, AP_b, AP_c, signed
  double repeatability = 0;                                       // m: RP_l = mean(l) + 3 S(l)
  Eigen::Vector3d angle_repeatability = Eigen::Vector3d::Zero();  // rad: RP_a = 3 S(a), ...
};

// None with fewer than two attained poses, or a value that is not finite.
DOPPEL_API std::optional<PoseFigures> pose_figures(std::span<const MeasuredPose> attained,
                                                   const MeasuredPose& commanded);

// Largest distance between the means of a pose that was approached from different directions (7.3.1).
struct DirectionFigures {
  double position = 0;                               // m: vAP_P
  Eigen::Vector3d angles = Eigen::Vector3d::Zero();  // rad: vAP_a, vAP_b, vAP_c
};

// `directions`: the figures of the same commanded pose, one for each direction. None with fewer than two.
DOPPEL_API std::optional<DirectionFigures> direction_figures(std::span<const PoseFigures> directions);

// The distance between two poses that were attained in turns (7.3.2, 7.3.3).
struct DistanceFigures {
  double accuracy = 0;                                            // m: AD_P = mean(D) - D_c, signed
  Eigen::Vector3d axis_accuracy = Eigen::Vector3d::Zero();        // m: AD_x, AD_y, AD_z
  Eigen::Vector3d angle_accuracy = Eigen::Vector3d::Zero();       // rad: AD_a, AD_b, AD_c
  double repeatability = 0;                                       // m: RD = 3 S(D)
  Eigen::Vector3d axis_repeatability = Eigen::Vector3d::Zero();   // m
  Eigen::Vector3d angle_repeatability = Eigen::Vector3d::Zero();  // rad
};

// Pose j of `first` and pose j of `second` are of cycle j. None with fewer than two cycles, unequal
// numbers, or a value that is not finite.
DOPPEL_API std::optional<DistanceFigures> distance_figures(std::span<const MeasuredPose> first,
                                                           std::span<const MeasuredPose> second,
                                                           const MeasuredPose& commanded_first,
                                                           const MeasuredPose& commanded_second);

// Largest change of the figures since the first ones (7.6).
struct DriftFigures {
  double accuracy = 0;                                            // m: dAP_P = |AP_P(1) - AP_P(t)|
  Eigen::Vector3d angle_accuracy = Eigen::Vector3d::Zero();       // rad
  double repeatability = 0;                                       // m: dRP_P
  Eigen::Vector3d angle_repeatability = Eigen::Vector3d::Zero();  // rad
};

// `over_time`: the figures of one pose, by time. None without figures.
DOPPEL_API std::optional<DriftFigures> drift_figures(std::span<const PoseFigures> over_time);

// One approach to a pose (7.4, 7.5).
struct ApproachFigures {
  bool reached = false;        // entered the limit band
  bool stays = false;          // is inside at the end
  double first_inside = 0;     // s on the time of the samples: enters for the first time
  double inside_for_good = 0;  // s on the time of the samples: enters for the last time
  double stabilisation = 0;    // s: t = inside_for_good - first_inside
  double overshoot = 0;        // m: OV, largest distance after first_inside, 0 if it is within the band
};

// `attained`: the pose at rest after the approach. `limit_band`: m, RP_l or a stated value, the radius
// around it. Straight lines between samples. None if times do not rise, a value is not finite, or the band
// is not positive.
DOPPEL_API std::optional<ApproachFigures> approach_figures(std::span<const double> time,
                                                           std::span<const Eigen::Vector3d> positions,
                                                           const Eigen::Vector3d& attained,
                                                           double limit_band);

}  // namespace doppel
