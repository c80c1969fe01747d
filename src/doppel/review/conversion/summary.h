#pragma once
// A summary of a description.

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/robot/semantics/planning_groups.h"

namespace doppel {

struct MeshSummary {
  std::size_t files = 0, triangles = 0;  // different files, and the triangles in them
  std::vector<std::string> missing;      // as written
  std::vector<std::string> unreadable;   // files, each with the reason
};

struct RobotSummary {
  double mass = 0;   // kg, as simulated
  int driven = 0;    // joints with a drive
  double reach = 0;  // m: the largest distance of a tip from the first movable joint
  std::string reach_from, reach_tip;
  Eigen::AlignedBox3d bounds;  // of all shapes at zero, in the root link's frame; empty: there are none
  MeshSummary meshes;
};

// `model` is compiled from `robot`.
DOPPEL_API RobotSummary summarise(const RobotDescription& robot, const Model& model);

// The files around a description.
struct Surroundings {
  std::vector<std::filesystem::path> files;  // read files, the description first
  std::string overlay;                       // a line about the corrections
  std::vector<std::filesystem::path> controller_files;
  std::vector<JointGroup> controllers;
};

// The summary as text of one screen.
DOPPEL_API std::string summary_text(const RobotDescription& robot, const RobotSummary& summary,
                                    const Surroundings& surroundings);

}  // namespace doppel
