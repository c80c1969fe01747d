#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "doppel/review/doctor/detail/probes.h"

namespace doppel::doctor {

std::string first_line(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

bool is_installed(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((std::filesystem::path(folder) / program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

Machine gather_facts(const ProgramPlace& program) {
  return {probe_program(program), probe_processor(),      probe_display(),
          probe_network(),        probe_storage(program), probe_serial()};
}

}  // namespace doppel::doctor
