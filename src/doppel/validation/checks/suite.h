#pragma once
// The suite file: what a machine is for, and by which limits it is judged. It is optional
// (validation/suite.yaml beside the package's config); docs/validate.md describes its keys.

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/export.h"

namespace doppel {

struct WorkspaceBox {
  std::string frame;                                                              // a link; empty: the root
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();  // m
  double step = 0.05;                                                             // m
  int directions = 26;
};

struct ToolLoad {
  std::string link;                                   // empty: the arm's tip
  double mass = 0;                                    // kg
  Eigen::Vector3d p_LoC_L = Eigen::Vector3d::Zero();  // m: the centre of mass in the link
};

// Limits of the step response. Sizes of revolute joints in rad, of slides in m.
struct StepResponseLimits {
  double size = 0.5, slide_size = 0.02;
  double overshoot = 0.10;  // of the step
  double settling = 0.5;    // s
  double error = 0.01, slide_error = 0.0004;
};

struct DropLimits {
  double settling = 2.0;      // s
  double penetration = 1e-3;  // m, at the end
  double deepest = 5e-3;      // m
  double energy = 0.01;       // of the energy at the start
  double rebound = 0.2;       // of the height of the fall
  double spread = 0.01;       // m between runs at different steps
};

// A region of the body that the tool may touch, by the user's own source.
struct ContactRegion {
  double force = 0;      // N: permitted
  double stiffness = 0;  // N/m
  double mass = 0;       // kg
};

// The source of power of the drives.
struct PowerSupply {
  double voltage = 0, current = 0;  // V, A: the largest current that it gives
  double efficiency = 1;            // of the drives: mechanical power by electric power
};

struct Waiver {
  std::string check;    // "G05"
  std::string subject;  // a link or joint; empty: all of the check
  std::string why;
  std::string until;  // "2027-06-01"; empty: it does not expire
  SourceLocation where;
};

struct DOPPEL_API Suite {
  std::filesystem::path file;  // empty: there is none
  std::optional<WorkspaceBox> workspace;
  ToolLoad tool;
  std::map<std::string, std::map<std::string, double>> poses;  // by name: joints, rad or m
  StepResponseLimits step;
  std::map<std::string, StepResponseLimits> joint_steps;  // by joint, complete
  double max_missed = 0.05;                               // of the reachable poses
  std::optional<double> max_share;  // of configurations in which the machine touches itself
  std::optional<double> min_seen;   // of the workspace, by each sensor
  DropLimits drop;
  std::map<std::string, ContactRegion> contact;  // by name
  std::optional<PowerSupply> supply;
  std::filesystem::path datasheet;
  std::vector<Waiver> waivers;

  [[nodiscard]] const StepResponseLimits& step_of(const std::string& joint) const {
    const auto found = joint_steps.find(joint);
    return found == joint_steps.end() ? step : found->second;
  }
};

// Throws InputError with all errors, each with its line and column: unknown keys with the nearest one,
// impossible values, a waiver without a reason or of an unknown check ("suite.*").
DOPPEL_API Suite load_suite(const std::filesystem::path& file);

}  // namespace doppel
