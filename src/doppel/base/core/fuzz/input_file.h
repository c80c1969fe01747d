#pragma once
// The input of a fuzz target as a file, for readers that take no text.

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace doppel {

// A folder of this process.
inline std::filesystem::path fuzz_folder() {
  const auto out = std::filesystem::temp_directory_path() / ("doppel_fuzz_" + std::to_string(getpid()));
  std::filesystem::create_directories(out);
  return out;
}

inline std::filesystem::path fuzz_file(const std::string& name, const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path folder = fuzz_folder();
  std::ofstream(folder / name, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  return folder / name;
}

}  // namespace doppel
