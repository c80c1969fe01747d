#pragma once
// A robot of a world as the world file's `robots:` or the command line specifies it.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/base/math/pose.h"
#include "doppel/description/urdf/load.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// The topics of the transforms of a robot with a namespace: `prefixed` is /tf with frames "NS/frame",
// `separate` is /NS/tf with the frames of the description.
enum class TfTopics { both, prefixed, separate };
inline constexpr const char* kTfTopicsNames[] = {"both", "prefixed", "separate"};

struct WorldRobot {
  std::string target = {};        // bundled name, .urdf, .xacro, or folder of a package or workspace
  XacroArguments arguments = {};  // name := value, in order
  // "left" or "fleet/left": prefix of its nodes, topics, services and frames, and its name in the world.
  // Empty: no prefix, and the description's name; at most one robot of a world.
  std::string name_space = {};
  std::optional<Pose> X_WR = {};  // its root link; none: World::X_WR
  // YAML files instead of those that the description names; later ones have priority.
  std::vector<std::filesystem::path> controllers = {};
  std::vector<std::string> activate = {};  // controllers to start; empty: all that the files declare
  bool tolerant = false;  // a controller that cannot be loaded or started is a warning, also a named one
  std::optional<BaseKind> base = {};  // of a root link other than "world"; none: choose_base()
  TfTopics tf = TfTopics::both;
  // Of a model of the SDF world that is a robot by its plugins, instead of a target; empty: it has a target.
  std::string model = {};
  SourceLocation source = {};  // in the world file; unknown: from the command line or a service
};

}  // namespace doppel
