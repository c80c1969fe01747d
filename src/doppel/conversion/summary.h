#pragma once
// What one wants to know of a description at first sight.

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "doppel/conversion/planning_groups.h"
#include "doppel/export.h"
#include "doppel/kinematics/model.h"

namespace doppel {

struct MeshSummary {
  std::size_t files = 0, triangles = 0;  // different files, and the triangles in them
  std::vector<std::string> missing;      // as written
  std::vector<std::string> unreadable;   // files, each with why
};

struct RobotSummary {
  double mass = 0;   // kg, as it is simulated
  int driven = 0;    // joints with a drive
  double reach = 0;  // m: the furthest that a tip comes from the first joint that moves
  std::string reach_from, reach_tip;
  Eigen::AlignedBox3d bounds;  // of all shapes at zero, in the root link's frame; empty: there are none
  MeshSummary meshes;
};

// `model` is compiled from `robot`.
DOPPEL_API RobotSummary summarise(const RobotDescription& robot, const Model& model);

// What surrounds a description.
struct Surroundings {
  std::vector<std::filesystem::path> files;  // that were read, the description first
  std::string overlay;                       // a line about the corrections
  std::vector<std::filesystem::path> controller_files;
  std::vector<JointGroup> controllers;
};

// One screen for people.
DOPPEL_API std::string summary_text(const RobotDescription& robot, const RobotSummary& summary,
                                    const Surroundings& surroundings);

}  // namespace doppel
