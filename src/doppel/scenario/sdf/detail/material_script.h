#pragma once
// Material scripts of OGRE 1, to which SDF's <material><script> refers: of each material the diffuse colour and the
// texture of its first texture unit. Source: the OGRE 1.12 manual, "Material Scripts".

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"
#include "doppel/scenario/sdf/detail/model_search.h"

namespace doppel::sdf {

struct ScriptedMaterial {
  std::optional<Eigen::Vector4d> diffuse;  // 0..1
  std::string texture;                     // the image's file name as written; empty: none
  std::string base;                        // the material that it inherits from; empty: none
};

// The materials by name. Everything else in the text is skipped.
DOPPEL_API std::map<std::string, ScriptedMaterial> parse_material_script(std::string_view text);

// The scripts of the URIs, each read once.
class MaterialScripts {
 public:
  // `search` nullptr: nothing is found.
  explicit MaterialScripts(ModelSearch* search) : search_(search) {}

  struct Found {
    std::optional<Eigen::Vector4d> diffuse;
    std::string texture;       // as written
    std::string texture_path;  // empty: none, or it is not found
  };
  // `uris`: script files, or folders of scripts and textures; `folder`: of the file that contains them. nullopt: no
  // such material.
  std::optional<Found> find(const std::string& name, const std::vector<std::string>& uris,
                            const std::filesystem::path& folder);

 private:
  using Materials = std::map<std::string, ScriptedMaterial>;
  const Materials& read(const std::filesystem::path& place);

  ModelSearch* search_;
  std::map<std::filesystem::path, Materials> read_;
};

}  // namespace doppel::sdf
