#pragma once
// Baking: what the overlay corrects becomes part of the sources themselves. The two expansions, without and
// with the overlay, are compared node by node; every difference is written at the place in the sources that
// its node names, and not a byte elsewhere changes. A place that several elements come from (a macro, a
// block) is only written where all of them change alike.

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "doppel/description/load.h"
#include "doppel/export.h"

namespace doppel {

struct BakedFile {
  std::filesystem::path file;
  std::string before, after;
};

// The files as they have to become. Throws InputError with every difference that has no place of its own,
// and why ("bake.shared", "bake.expression", "bake.place"). Writes nothing.
DOPPEL_API std::vector<BakedFile> bake_in_place(const ExpandedDescription& plain,
                                                const ExpandedDescription& corrected);

// Writes all or none, and undoes everything where `holds`, asked after the last one, says no: it expands the
// new sources and compares. Originals lie beside the files (".NAME.before-bake") until all is done.
DOPPEL_API void write_baked(const std::vector<BakedFile>& files, const std::function<bool()>& holds);

// The same elements with the same values: in the robot's own list the order does not matter.
DOPPEL_API bool same_expansion(const XmlNode& a, const XmlNode& b);

// Meshes that operations made lie in the user's cache. Points the tree to where a package has its meshes
// (`folder`/meshes, as `prefix` + "meshes/NAME.stl") and returns what has to be copied: from, to.
DOPPEL_API std::vector<std::pair<std::filesystem::path, std::filesystem::path>> settle_meshes(
    XmlNode& root, const std::filesystem::path& folder, const std::string& prefix);

}  // namespace doppel
