#include "doppel/lab/recording/run_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

#include "doppel/base/core/installation.h"
#include "doppel/base/core/output_file.h"
#include "doppel/base/core/path_below.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/packages/package_folder.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/twin/publishers/object_publisher.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTextType = "text/plain";
constexpr std::size_t kMaxFileBytes = std::size_t{256} << 20;

fs::path absolute_path(const fs::path& path) {
  std::error_code none;
  return fs::absolute(path, none).lexically_normal();
}

std::vector<std::byte> bytes_of_text(const std::string& text) {
  const auto* const data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}

std::optional<std::vector<std::byte>> bytes_of(const fs::path& file, std::size_t max_bytes) {
  const FileContent content = read_content(file, max_bytes);
  return content.was_read() ? std::optional(bytes_of_text(content.bytes)) : std::nullopt;
}

fs::path common_folder(const std::set<fs::path>& files) {
  if (files.empty()) return fs::current_path();
  fs::path out = files.begin()->parent_path();
  while (!std::ranges::all_of(files, [&](const fs::path& file) { return path_below(file, out).has_value(); }))
    out = out.parent_path();
  return out;
}

// The user's own files, with what makes their folders packages or models, which are found by it.
std::set<fs::path> attached_files(const std::vector<ReadFile>& files) {
  const fs::path data = absolute_path(data_folder());
  std::set<fs::path> out;
  const auto add_if_file = [&out](const fs::path& file) {
    std::error_code none;
    if (fs::is_regular_file(file, none)) out.insert(file);
  };
  for (const ReadFile& one : files) {
    const fs::path file = absolute_path(one.file);
    if (path_below(file, data)) continue;
    add_if_file(file);
    if (const fs::path package = package_around(file); !package.empty())
      add_if_file(absolute_path(package / "package.xml"));
    if (const fs::path model = model_around(file); !model.empty())
      add_if_file(absolute_path(model / "model.config"));
  }
  return out;
}

// The meshes that are drawn or collide, by the URIs under which messages name them.
std::map<std::string, fs::path> meshes_of(const std::vector<ModelInstance>& instances) {
  std::map<std::string, fs::path> out;
  const auto add = [&out](const Geometry& geometry, bool is_object) {
    const auto* const mesh = std::get_if<MeshGeometry>(&geometry);
    if (mesh == nullptr || mesh->path.empty()) return;
    out[is_object ? mesh_resource(*mesh) : mesh->uri] = absolute_path(mesh->path);
  };
  for (const ModelInstance& instance : instances) {
    const bool is_object = instance.is_object();
    for (const Link& link : instance.description->links) {
      for (const Visual& visual : link.visuals) add(visual.geometry, is_object);
      for (const Collision& collision : link.collisions) add(collision.geometry, is_object);
    }
  }
  return out;
}

std::vector<BagAttachment> attached_meshes(const std::map<std::string, fs::path>& meshes, std::uint64_t room,
                                           std::vector<std::string>& omitted) {
  std::vector<BagAttachment> out;
  for (const auto& [uri, file] : meshes) {
    auto bytes = bytes_of(file, room);
    if (!bytes) {
      omitted.push_back(uri);
      continue;
    }
    room -= bytes->size();
    out.push_back({uri, kMeshMediaType, std::move(*bytes)});
  }
  return out;
}

}  // namespace

RunSources run_sources(const Twin& twin) {
  RunSources out;
  out.scenario = twin.complete_scenario();
  out.files = twin.files();
  for (const std::string& plugin : out.scenario.plugins) out.files.emplace_back(plugin);
  for (const auto& parameter : out.scenario.ros.parameters) {
    if (const auto* file = std::get_if<GivenParameterFile>(&parameter)) out.files.emplace_back(file->path);
  }
  out.meshes = meshes_of(twin.engine().world().instances());
  const EngineCapabilities& engine = twin.engine().world().capabilities();
  out.engine = fmt::format("{} {}", engine.name, engine.version);
  return out;
}

std::vector<ReadFile> files_of_run(const Twin& twin) {
  return files_with_hashes(run_sources(twin).files);
}

RunFiles run_files(const RunSources& sources, const std::string& version, std::uint64_t max_mesh_bytes) {
  RunFiles out;
  std::map<fs::path, std::string> attached;  // attachments by their files
  out.attachments = attached_meshes(sources.meshes, max_mesh_bytes, out.omitted);
  for (const BagAttachment& mesh : out.attachments) attached[sources.meshes.at(mesh.name)] = mesh.name;
  const std::vector<ReadFile> files = files_with_hashes(sources.files);
  const std::set<fs::path> users = attached_files(files);
  const fs::path root = common_folder(users);
  for (const fs::path& file : users) {
    const std::string place = file.lexically_relative(root).generic_string();
    if (const auto found = attached.find(file); found != attached.end()) {
      out.places.emplace_back(place, found->second);
      continue;
    }
    auto bytes = bytes_of(file, kMaxFileBytes);
    if (!bytes) continue;  // it was removed since; its hash is in the scenario
    const std::string name = "files/" + place;
    out.attachments.push_back({name, kTextType, std::move(*bytes)});
    out.places.emplace_back(place, name);
  }
  const std::string scenario = scenario_text(sources.scenario, files, root, ScenarioFormat::yaml);
  out.attachments.push_back({kScenarioAttachment, "application/yaml", bytes_of_text(scenario)});
  out.about = {{"root", root.string()}, {"version", version}, {"engine", sources.engine}};
  return out;
}

std::vector<BagAttachment> mesh_attachments(const std::vector<ModelInstance>& instances,
                                            std::uint64_t max_bytes, std::vector<std::string>& omitted) {
  return attached_meshes(meshes_of(instances), max_bytes, omitted);
}

fs::path write_run_files(const std::map<std::string, std::vector<std::byte>>& attachments,
                         const std::vector<std::pair<std::string, std::string>>& places,
                         const fs::path& folder) {
  const auto write = [&](const fs::path& file, const std::string& attachment) {
    const auto found = attachments.find(attachment);
    if (found == attachments.end()) {
      throw InputError("bag.no_run", {}, fmt::format("the recording has no attachment '{}'", attachment),
                       "use the first file of the recording, which has the files of the run");
    }
    std::error_code error;
    fs::create_directories(file.parent_path(), error);
    write_whole(file, {reinterpret_cast<const char*>(found->second.data()), found->second.size()});
  };
  for (const auto& [place, attachment] : places) {
    const auto way = path_below(place, folder);
    if (!way) {
      throw InputError("bag.no_run", {},
                       fmt::format("the recording's file '{}' leads out of its folder", place),
                       "the recording was not made by doppel, or was changed");
    }
    write(folder / *way, attachment);
  }
  const fs::path scenario = folder / kScenarioAttachment;
  write(scenario, kScenarioAttachment);
  return scenario;
}

}  // namespace doppel
