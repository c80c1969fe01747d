// Fuzz target: a scenario file. What is read is written, and reads again.
#include <cstdint>
#include <cstdlib>

#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/base/core/utf8.h"
#include "doppel/scenario/schema/scenario_file.h"

namespace {

bool reads(const std::string& text) {
  try {
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(text.data());
    static_cast<void>(doppel::load_scenario(doppel::fuzz_file("again.yaml", bytes, text.size()), "/bundled"));
    return true;
  } catch (const doppel::InputError&) {
    return false;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using doppel::ScenarioFormat;
  if (!doppel::is_utf8({reinterpret_cast<const char*>(data), size})) return 0;
  const std::filesystem::path file = doppel::fuzz_file("run.yaml", data, size);
  static_cast<void>(doppel::is_scenario_file(file));
  try {
    const doppel::ScenarioFile read = doppel::load_scenario(file, "/bundled");
    for (const ScenarioFormat format : {ScenarioFormat::yaml, ScenarioFormat::json}) {
      if (!reads(doppel::scenario_text(read.scenario, read.files, file.parent_path(), format))) std::abort();
    }
  } catch (const doppel::InputError&) {
  }
  return 0;
}
