#include "doppel/review/conversion/mesh_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "doppel/base/core/output_file.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/text.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/meshes/mesh.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxMeshBytes = std::size_t{1} << 30;

std::string lower_extension(const fs::path& file) {
  const std::string text = lowered(file.extension().string());
  return text.empty() ? text : text.substr(1);
}

// The size of a binary STL corresponds to its number of triangles.
bool is_binary_stl(const fs::path& file) {
  constexpr std::size_t kHead = 84;
  const std::string head = beginning_of_file(file, kHead);
  if (head.size() < kHead) return false;
  std::uint32_t count = 0;
  std::memcpy(&count, &head[80], sizeof count);
  std::error_code none;
  return fs::file_size(file, none) == kHead + std::uintmax_t{50} * count;
}

bool readable_as(const fs::path& file, const std::vector<std::string>& kinds) {
  const std::string kind = lower_extension(file);
  if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) return false;
  return kind != "stl" || is_binary_stl(file);
}

std::string obj_text(const fs::path& file) {
  const TriangleMesh mesh = load_mesh(file.string(), Eigen::Vector3d::Ones());
  std::string out;
  for (const Eigen::Vector3f& p : mesh.vertices) out += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
  for (const auto& t : mesh.triangles) out += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return out;
}

// package://NAME/rest for a file in a package; empty: it is in none.
std::string package_uri(const fs::path& file) {
  std::error_code none;
  for (fs::path at = file.parent_path(); at.has_relative_path(); at = at.parent_path()) {
    if (!fs::is_regular_file(at / "package.xml", none)) continue;
    const XmlNode package = load_xml((at / "package.xml").string());
    const XmlNode* name = package.first("name");
    if (name == nullptr) return "";
    return fmt::format("package://{}/{}", name->content(), file.lexically_relative(at).generic_string());
  }
  return "";
}

// Files and folders that did not exist before; the destructor removes them, unless they are kept.
class NewFiles {
 public:
  NewFiles() = default;
  NewFiles(const NewFiles&) = delete;
  NewFiles& operator=(const NewFiles&) = delete;
  ~NewFiles() {
    std::error_code none;
    for (auto file = paths_.rbegin(); file != paths_.rend(); ++file) fs::remove(*file, none);
  }
  void add(const fs::path& file) {
    std::error_code none;
    if (!fs::exists(file, none)) paths_.push_back(file);
  }
  void add_folders(const fs::path& folder) {
    std::error_code none;
    if (fs::exists(folder, none)) return;
    if (folder.has_parent_path() && folder != folder.parent_path()) add_folders(folder.parent_path());
    paths_.push_back(folder);
  }
  void keep() { paths_.clear(); }

 private:
  std::vector<fs::path> paths_;  // a folder before what is in it
};

}  // namespace

MeshFiles::MeshFiles(MeshPlacement placement) : placement_(std::move(placement)) {
  placement_.out_folder = fs::weakly_canonical(fs::absolute(placement_.out_folder));
}

std::string MeshFiles::relative(const fs::path& file) const {
  return file.lexically_relative(placement_.out_folder).generic_string();
}

fs::path MeshFiles::planned_name(const fs::path& from, bool as_obj) {
  const fs::path folder = (placement_.out_folder / placement_.copy_to.value_or("meshes")).lexically_normal();
  const std::string extension = as_obj ? ".obj" : from.extension().string();
  for (int i = 1;; ++i) {
    const std::string stem = from.stem().string() + (i == 1 ? "" : fmt::format("_{}", i));
    const fs::path to = folder / (stem + extension);
    const auto [found, fresh] = planned_.try_emplace(to, Planned{from, as_obj});
    if (fresh || found->second.from == from) return to;
  }
}

std::string MeshFiles::reference(const MeshGeometry& mesh) {
  if (mesh.path.empty()) return mesh.uri;
  const fs::path file = fs::weakly_canonical(mesh.path);
  if (placement_.copy_to) return relative(planned_name(file, false));
  if (placement_.package_uris) {
    if (mesh.uri.starts_with("package://")) return mesh.uri;
    if (std::string uri = package_uri(file); !uri.empty()) return uri;
  }
  return relative(file);
}

std::string MeshFiles::reference(const MeshGeometry& mesh, const std::vector<std::string>& kinds) {
  if (mesh.path.empty()) return mesh.uri;
  const fs::path file = fs::weakly_canonical(mesh.path);
  if (!readable_as(file, kinds)) return relative(planned_name(file, true));
  return placement_.copy_to ? relative(planned_name(file, false)) : relative(file);
}

void MeshFiles::write() const {
  NewFiles written;  // removed again if one of them cannot be written
  for (const auto& [to, planned] : planned_) {
    std::error_code failed;
    written.add_folders(to.parent_path());
    fs::create_directories(to.parent_path(), failed);
    if (failed) {
      throw InputError("output.unwritable", make_location(to.parent_path().string()),
                       fmt::format("cannot create the folder for meshes: {}", failed.message()),
                       "choose another with --copy-meshes DIR");
    }
    if (!planned.as_obj && fs::equivalent(planned.from, to, failed)) continue;
    written.add(to);
    write_whole(to,
                planned.as_obj ? obj_text(planned.from) : read_file(planned.from.string(), kMaxMeshBytes));
  }
  written.keep();
}

}  // namespace doppel
