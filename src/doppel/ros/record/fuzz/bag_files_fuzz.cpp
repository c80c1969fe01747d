// Fuzz target: the text files beside a bag. The first byte selects one: metadata.yaml, a file of output bags,
// or qualities of topics. They are refused with errors that have a place, or read.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/record/bag_metadata.h"
#include "doppel/ros/record/bag_outputs.h"
#include "doppel/ros/record/qos_overrides.h"

namespace {

namespace fs = std::filesystem;

struct Folder {
  Folder() { fs::create_directories(path); }
  ~Folder() {
    std::error_code none;
    fs::remove_all(path, none);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path path = fs::temp_directory_path() / ("doppel_bag_files_fuzz_" + std::to_string(getpid()));
};

void read(std::uint8_t kind, const fs::path& file) {
  doppel::Diagnostics notes;
  switch (kind % 3) {
    case 0:
      (void)doppel::files_of_bag_metadata(file);
      break;
    case 1:
      (void)doppel::read_output_bags(file, notes);
      break;
    default:
      (void)doppel::read_qos_overrides(file);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  if (size == 0) return 0;
  const fs::path file = folder.path / "file.yaml";
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(data + 1), static_cast<std::streamsize>(size - 1));
  try {
    read(data[0], file);
  } catch (const doppel::InputError& error) {
    if (error.diagnostics().empty()) std::abort();
  }
  return 0;
}
