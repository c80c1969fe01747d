#pragma once
// A robot that is to stand in a world: what a world file's `robots:` or the command line specifies of it.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/core/source_location.h"
#include "doppel/description/load.h"
#include "doppel/kinematics/model.h"
#include "doppel/math/pose.h"

namespace doppel {

// Where the transforms of a robot with a namespace are published: on /tf with its frames below "NS/", on
// /NS/tf with its frames as the description names them, or on both.
enum class TfTopics { both, prefixed, separate };
inline constexpr const char* kTfTopicsNames[] = {"both", "prefixed", "separate"};

struct WorldRobot {
  std::string target = {};        // bundled name, .urdf, .xacro, or folder of a package or workspace
  XacroArguments arguments = {};  // name := value, in order
  // "left" or "fleet/left": before its nodes, topics, services and frames, and its name in the world. Empty:
  // none, and the description's name; one robot of a world may be so.
  std::string name_space = {};
  std::optional<Pose> X_WR = {};  // its root link; none: World::X_WR
  std::optional<std::filesystem::path> controllers =
      {};                                  // a YAML file in place of what the description names
  std::vector<std::string> activate = {};  // controllers to start; empty: all that the files declare
  std::optional<BaseKind> base = {};       // how a root link other than "world" stands; none: choose_base()
  TfTopics tf = TfTopics::both;
  SourceLocation source = {};  // in the world file; unknown: named elsewhere
};

}  // namespace doppel
