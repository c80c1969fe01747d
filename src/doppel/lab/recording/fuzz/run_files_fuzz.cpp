// Fuzz target: the files of a run as a recording lists them. The bytes until the first NUL are the lines of
// places, the rest is the scenario. Whatever the places are, nothing is written beside the run's folder.
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/lab/recording/run_files.h"
#include "doppel/scenario/schema/scenario_file.h"

namespace {

namespace fs = std::filesystem;

// The folder of a run is three levels below one that has nothing else.
struct Folder {
  Folder() { fs::create_directories(path / "a/b"); }
  ~Folder() {
    std::error_code none;
    fs::remove_all(path, none);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path path = fs::temp_directory_path() / ("doppel_run_files_fuzz_" + std::to_string(getpid()));
};

bool has_nothing_else(const fs::path& folder, const char* name) {
  return std::ranges::all_of(fs::directory_iterator(folder), [name](const fs::directory_entry& entry) {
    return entry.path().filename() == name;
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const std::size_t end = std::min(text.find('\0'), size);
  std::vector<std::pair<std::string, std::string>> places;
  std::istringstream lines(text.substr(0, end));
  for (std::string line; std::getline(lines, line);) places.emplace_back(line, "one");
  const auto* const rest = reinterpret_cast<const std::byte*>(data) + std::min(end + 1, size);
  const fs::path run = folder.path / "a/b/run";
  fs::create_directory(run);
  try {
    const fs::path scenario = doppel::write_run_files(
        {{"one", {std::byte{'x'}}},
         {doppel::kScenarioAttachment, {rest, reinterpret_cast<const std::byte*>(data) + size}}},
        places, run);
    if (!doppel::load_scenario(scenario, "").scenario.plugins.empty()) std::abort();
  } catch (const doppel::InputError& error) {
    if (error.diagnostics().empty()) std::abort();
  }
  if (!has_nothing_else(folder.path, "a") || !has_nothing_else(folder.path / "a", "b") ||
      !has_nothing_else(folder.path / "a/b", "run"))
    std::abort();
  fs::remove_all(run);
  return 0;
}
