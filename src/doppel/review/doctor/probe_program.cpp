#include "doppel/physics/contract/engine_modules.h"
#include "doppel/review/doctor/detail/probes.h"

namespace doppel::doctor {

ProgramFacts probe_program(const ProgramPlace& program) {
  ProgramFacts facts;
  facts.version = program.version;
  facts.page_folder = program.page_folder;
  std::error_code none;
  facts.page_is_built = std::filesystem::exists(program.page_folder / "index.html", none);
  for (const KnownEngine& known : known_engines()) {
    ProgramFacts::Engine engine{known.name, known.package, known.name == kDefaultEngine, known.available, ""};
    if (known.available) {
      try {
        (void)engine_module(known.name);
      } catch (const std::exception& error) {
        engine.failure = error.what();
      }
    }
    facts.engines.push_back(std::move(engine));
  }
  return facts;
}

}  // namespace doppel::doctor
