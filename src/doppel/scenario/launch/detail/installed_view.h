#pragma once
// The share folder of a source package that is installed with another layout than that of its source.

#include <filesystem>
#include <string>

namespace doppel {

// A folder with links to the files of `package` where `install(DIRECTORY ... DESTINATION share/...)` of its
// CMakeLists.txt puts them, made below `folder`; empty: the layout is that of the source. Does not throw.
std::filesystem::path installed_view(const std::filesystem::path& package, const std::string& name,
                                     const std::filesystem::path& folder);

}  // namespace doppel
