#pragma once
// The references of a written document to its meshes: by paths relative to it, or by package URIs, optionally
// with copies of the files.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

struct MeshPlacement {
  std::filesystem::path out_folder;              // of the document
  bool package_uris = false;                     // package://NAME/... instead of relative paths
  std::optional<std::filesystem::path> copy_to;  // folder for copies, relative to out_folder or absolute
};

class DOPPEL_API MeshFiles {
 public:
  explicit MeshFiles(MeshPlacement placement);

  // The text to write for the mesh; its URI unchanged if it has no file.
  std::string reference(const MeshGeometry& mesh);
  // The same for a tool that reads only these kinds ("stl", "obj"; "stl" means a binary one): any other file
  // is converted to OBJ, in meshes/ if no folder for copies is given.
  std::string reference(const MeshGeometry& mesh, const std::vector<std::string>& kinds);

  // Copies and converts the files of all references so far. Throws InputError.
  void write() const;
  [[nodiscard]] std::size_t to_write() const { return planned_.size(); }

 private:
  struct Planned {
    std::filesystem::path from;
    bool as_obj = false;
  };
  std::filesystem::path planned_name(const std::filesystem::path& from, bool as_obj);
  [[nodiscard]] std::string relative(const std::filesystem::path& file) const;

  MeshPlacement placement_;
  std::map<std::filesystem::path, Planned> planned_;  // by the file to be written
};

}  // namespace doppel
