#pragma once
// The files that a run reads, and the attachments of its recording that hold them: the scenario, the files
// by their places, and the meshes under the URIs of their descriptions, so that a page draws the robot from
// the recording alone. The files that come with doppel are not attached, but for meshes.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/ros/record/bag_writer.h"
#include "doppel/scenario/schema/scenario_file.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {

// All that a run reads: the twin's files, and those that its arguments name.
[[nodiscard]] DOPPEL_API std::vector<ReadFile> files_of_run(const Twin& twin);

// The same without their bytes, which any thread can read. The loop's thread, before the first step.
struct RunSources {
  Scenario scenario;  // with every choice that was made
  std::vector<std::filesystem::path> files;
  std::map<std::string, std::filesystem::path> meshes;  // by the URIs under which messages name them
  std::string engine;                                   // with its version
};
[[nodiscard]] DOPPEL_API RunSources run_sources(const Twin& twin);

inline constexpr const char* kScenarioAttachment = "scenario.yaml";
inline constexpr const char* kMeshMediaType = "model/mesh";  // of attached meshes
inline constexpr const char* kFilesOfRunMetadata = "doppel_files";
inline constexpr const char* kRunMetadata = "doppel_run";
inline constexpr const char* kKeepsStates = "keeps_states";  // of kRunMetadata: "yes" or "no"

struct RunFiles {
  std::vector<BagAttachment> attachments;
  // kFilesOfRunMetadata: the attachment with a file's bytes, by its path below the folder of the scenario.
  std::vector<std::pair<std::string, std::string>> places;
  // kRunMetadata: "root", the folder of the scenario; "version" of doppel; "engine" with its version.
  std::vector<std::pair<std::string, std::string>> about;
  std::vector<std::string> omitted;  // meshes beyond `max_mesh_bytes`, by their URIs
};

// Any thread. version: of doppel. max_mesh_bytes: of all meshes together.
[[nodiscard]] DOPPEL_API RunFiles run_files(const RunSources& sources, const std::string& version,
                                            std::uint64_t max_mesh_bytes);

// The meshes of these instances that fit into `max_bytes` together; `omitted` gets the URIs of the others.
[[nodiscard]] DOPPEL_API std::vector<BagAttachment> mesh_attachments(
    const std::vector<ModelInstance>& instances, std::uint64_t max_bytes, std::vector<std::string>& omitted);

// Writes what run_files() has attached into an empty folder, and returns the scenario's file there. Throws
// InputError: a path that leads out of the folder, an attachment that is missing, a folder that is not
// writable.
[[nodiscard]] DOPPEL_API std::filesystem::path write_run_files(
    const std::map<std::string, std::vector<std::byte>>& attachments,
    const std::vector<std::pair<std::string, std::string>>& places, const std::filesystem::path& folder);

}  // namespace doppel
