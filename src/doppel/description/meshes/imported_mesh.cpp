#include "doppel/description/meshes/imported_mesh.h"

#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "doppel/base/core/plugin_module.h"
#include "doppel/base/core/read_file.h"
#include "doppel/description/meshes/detail/mesh.h"
#include "doppel/description/meshes/mesh.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxAssimpBytes = std::size_t{256} << 20;  // assimp takes many times that

constexpr std::size_t kMaxPointerBytes = 1024;

// A pointer file, which `git clone` writes instead of a file if Git LFS is not installed.
bool is_lfs_pointer(std::string_view bytes) {
  return bytes.size() < kMaxPointerBytes && bytes.starts_with("version https://git-lfs.github.com/spec/");
}

// Only regular files: assimp opens the path itself, and would wait for the writer of a pipe, or read a
// device without end.
void check_foreign(const std::string& path) {
  std::error_code failed;
  const fs::file_status status = fs::status(path, failed);
  if (!fs::is_regular_file(status))
    mesh::refuse(path, 0, fs::exists(status) ? "it is not a regular file" : "the file does not exist");
  if (fs::file_size(path, failed) > kMaxAssimpBytes || failed)
    mesh::refuse(path, 0, fmt::format("it is larger than {} MB", kMaxAssimpBytes >> 20));
}

}  // namespace

bool is_fetched(const std::string& path) {
  return !is_lfs_pointer(beginning_of_file(path, kMaxPointerBytes));
}

void mesh::refuse_pointer(std::string_view bytes, const std::string& path) {
  if (!is_lfs_pointer(bytes)) return;
  throw InputError("mesh.not_fetched", make_location(path),
                   "the file has not been fetched: this is its Git LFS pointer",
                   "install Git LFS and run: git lfs pull");
}

ImportedMesh import_mesh(const std::string& path) {
  using Import = bool (*)(const std::string& path, ImportedMesh& file, std::string& problem);
  static const auto import = reinterpret_cast<Import>(plugin_symbol("doppel_assimp", "doppel_import_mesh"));
  check_foreign(path);
  if (fs::file_size(path) < kMaxPointerBytes) mesh::refuse_pointer(read_file(path, kMaxPointerBytes), path);
  ImportedMesh file;
  std::string problem;
  if (!import(path, file, problem))
    mesh::refuse(path, 0, fmt::format("the mesh cannot be read: {}", problem));
  return file;
}

}  // namespace doppel
