#include <fstream>

#include "doppel/review/doctor/detail/probes.h"

namespace doppel::doctor {

std::string first_line(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

Machine gather_facts(const ProgramPlace& program) {
  return {probe_program(program), probe_processor(),      probe_display(),
          probe_network(),        probe_storage(program), probe_serial()};
}

}  // namespace doppel::doctor
