// Fuzz target: a scenario file. What is read is written, and reads again.
#include <cstdint>

#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/scenario/schema/scenario_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using doppel::ScenarioFormat;
  const std::filesystem::path file = doppel::fuzz_file("run.yaml", data, size);
  static_cast<void>(doppel::is_scenario_file(file));
  try {
    const doppel::ScenarioFile read = doppel::load_scenario(file, "/bundled");
    for (const ScenarioFormat format : {ScenarioFormat::yaml, ScenarioFormat::json}) {
      const std::string text = doppel::scenario_text(read.scenario, read.files, file.parent_path(), format);
      const auto* const bytes = reinterpret_cast<const std::uint8_t*>(text.data());
      static_cast<void>(
          doppel::load_scenario(doppel::fuzz_file("again.yaml", bytes, text.size()), "/bundled"));
    }
  } catch (const doppel::InputError&) {
  }
  return 0;
}
