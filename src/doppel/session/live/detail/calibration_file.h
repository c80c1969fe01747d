#pragma once
// Corrections of measured joints on their way into the overlay of a description, and back. Any thread.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/description/overlay/operation.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

struct MeasuredJoint {
  Joint joint;  // of the model that was measured
  std::vector<Operation> operations;
};

struct WrittenCorrections {
  std::string name_space;
  std::vector<std::string> joints;
  std::filesystem::path file;
  std::optional<std::string> before;  // the whole file; nullopt: there was none
  std::string after;
};

// Measurements of the one are valid for the other.
[[nodiscard]] bool is_same_joint(const Joint& a, const Joint& b);

// Throws InputError: a joint of the file is another one than was measured, its overlay contains the
// correction already, the file cannot be read or written.
WrittenCorrections write_corrections(const WorldRobot& robot, const std::filesystem::path& bundled_robots,
                                     std::vector<MeasuredJoint> joints);
// The file as it was before. Throws InputError: it has changed since, or cannot be written.
void take_back(const WrittenCorrections& written);

}  // namespace doppel
