#pragma once
// A scenario as a file: YAML or JSON with all that a run reads, and the SHA-256 of each file
// (docs/scenarios.md). Paths are relative to the folder of the scenario file; those of the data that come
// with doppel begin with "bundled:".

#include <filesystem>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

// A file that a run reads, such as a description, a mesh, an overlay or a controllers' file.
inline constexpr const char* kNoFile = "none";
struct ReadFile {
  std::filesystem::path file;
  std::string sha256;  // of its bytes, 64 digits; kNoFile: there is no such file
  SourceLocation where = {};
};

struct ScenarioFile {
  Scenario scenario;
  std::vector<ReadFile> files;  // when it was written
  std::string content_hash;     // of the scenario and the bytes of these files; empty: not written
};

// True for a file that has the key doppel_scenario. Does not throw.
DOPPEL_API bool is_scenario_file(const std::filesystem::path& file);

// Throws InputError with all errors of the file: unknown keys with the nearest one, wrong types, values that
// are missing in a complete scenario. `bundled_robots`: of the result.
// `plugins`: the libraries that the user names. The file is data, of a stranger perhaps, and loads no code:
// for each library that it lists the run gets the one of the same file name in `plugins`; a library that is
// only in one of the two lists is an error.
DOPPEL_API ScenarioFile load_scenario(const std::filesystem::path& file,
                                      const std::filesystem::path& bundled_robots,
                                      const std::vector<std::string>& plugins = {});

// The present bytes of files, each once, in their order.
DOPPEL_API std::vector<ReadFile> files_with_hashes(const std::vector<std::filesystem::path>& files);

// SHA-256 over the scenario and the hashes of its files. `folder`: of the scenario file; another place of the
// same files beside it has the same hash.
DOPPEL_API std::string content_hash(const Scenario& scenario, const std::vector<ReadFile>& files,
                                    const std::filesystem::path& folder);

enum class ScenarioFormat { yaml, json };
// The text of a scenario file in `folder`, with its content hash.
DOPPEL_API std::string scenario_text(const Scenario& scenario, const std::vector<ReadFile>& files,
                                     const std::filesystem::path& folder, ScenarioFormat format);

// A note for each file of a scenario file whose bytes have changed since it was written.
DOPPEL_API void report_changed_files(const ScenarioFile& file, Diagnostics& diagnostics);

}  // namespace doppel
