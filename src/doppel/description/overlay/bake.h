#pragma once
// Baking writes the corrections of the overlay into the source files. The expansions without and with the
// overlay are compared node by node; every difference is written at the source location of its node, and no
// other byte changes. A location from which several elements are expanded (a macro, a block) is only written
// if all of them change in the same way.

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "doppel/description/urdf/load.h"
#include "doppel/export.h"

namespace doppel {

struct BakedFile {
  std::filesystem::path file;
  std::string before, after;
};

// The new contents of the files. Throws InputError with every difference that cannot be written at one place,
// and the reason ("bake.shared", "bake.expression", "bake.place"). Does not write files.
DOPPEL_API std::vector<BakedFile> bake_in_place(const ExpandedDescription& plain,
                                                const ExpandedDescription& corrected);

// Writes all files or none, and restores them if `holds`, called after the last one, returns false; it
// expands the new sources and compares. The originals are kept next to the files (".NAME.before-bake") until
// the end. Throws InputError.
DOPPEL_API void write_baked(const std::vector<BakedFile>& files, const std::function<bool()>& holds);

// True if two trees have the same elements with the same values; the order of the children of
// <robot> is ignored.
DOPPEL_API bool same_expansion(const XmlNode& a, const XmlNode& b);

// Meshes that operations generate are in the user's cache. Changes the tree to use the package's folder of
// meshes (`folder`/meshes, as `prefix` + "meshes/NAME.stl") and returns the files to be copied: from, to.
DOPPEL_API std::vector<std::pair<std::filesystem::path, std::filesystem::path>> settle_meshes(
    XmlNode& root, const std::filesystem::path& folder, const std::string& prefix);

}  // namespace doppel
