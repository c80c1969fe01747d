#pragma once
// Private to this module: paths in a scenario file.

#include <filesystem>
#include <string>

namespace doppel::schema_detail {

// The path as a file in `folder` writes it: relative to it, or "bundled:" and the path in the data that come
// with doppel.
std::string written_path(const std::filesystem::path& path, const std::filesystem::path& folder);
// The same of a word that may be the name of a robot or world instead, which is kept.
std::string written_word(const std::string& word, const std::filesystem::path& folder);
// The inverse. A file in `folder` has priority over a package or a bundled robot of the same name.
std::filesystem::path read_path(const std::string& written, const std::filesystem::path& folder);
std::string read_word(const std::string& written, const std::filesystem::path& folder);

}  // namespace doppel::schema_detail
