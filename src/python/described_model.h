#pragma once
// A description as Python's Model holds it: loaded once, with its compiled model, its messages, and what a
// twin of it is made from.

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/load.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/robot/collision/collision_scene.h"
#include "doppel/robot/kinematics/model.h"
#include "python/process_owned.h"

namespace doppel::python {

// A folder for files that other parts of the program read by path; removed with the last model that uses it,
// in the process that made it.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  OwningProcess process_;
  std::filesystem::path path_;
};

struct DescribedModel {
  std::string target;        // of Model.load: a bundled name, a path, or the file that a text was written to
  XacroArguments arguments;  // of it
  std::string twin_target;   // what a twin reads: the target, or the URDF with an overlay applied
  XacroArguments twin_arguments;
  std::shared_ptr<const RobotDescription> robot;
  std::shared_ptr<const Model> model;
  std::filesystem::path file;  // of the description
  std::vector<std::filesystem::path> files;
  std::vector<Diagnostic> diagnostics;
  std::shared_ptr<const TemporaryFolder> folder;  // nullptr: nothing was written

  // The robot alone (reach_scene), made by the first call. Any thread.
  [[nodiscard]] std::shared_ptr<const CollisionScene> scene() const;

 private:
  mutable std::once_flag scene_once_;
  mutable std::shared_ptr<const CollisionScene> scene_;
};

// `source`: a bundled robot, a file, a folder of a package, or the text of a URDF or xacro. `overlay`: a
// file or YAML, applied after the overlays that stand beside the files; empty: none. Throws InputError.
std::shared_ptr<DescribedModel> load_model(const std::string& source, XacroArguments arguments,
                                           const std::string& overlay, BaseKind base);

}  // namespace doppel::python
