#include <fmt/format.h>

#include <algorithm>

#include "doppel/review/doctor/findings.h"

namespace doppel::doctor {
namespace {

Finding judge_engine(const ProgramFacts::Engine& engine, bool is_only_hope) {
  Finding finding{Level::ok, "engines", "engine." + engine.name, engine.name + " loads", "", ""};
  if (engine.is_built && engine.failure.empty()) {
    if (engine.is_default) finding.what += "; it is the default";
    return finding;
  }
  finding.level = engine.is_default || is_only_hope ? Level::problem : Level::note;
  finding.what = engine.is_built ? fmt::format("{} does not load: {}", engine.name, engine.failure)
                                 : fmt::format("{} is not part of this installation", engine.name);
  finding.why = engine.is_default ? "`doppel up` needs it unless --engine names another one"
                                  : fmt::format("--engine {} and compare-engines do without it", engine.name);
  finding.remedy = engine.package.empty()
                       ? "install it again"
                       : fmt::format("apt install {}, and build or install doppel again", engine.package);
  return finding;
}

}  // namespace

std::vector<Finding> judge_program(const ProgramFacts& facts) {
  std::vector<Finding> out;
  out.push_back({Level::ok, "program", "version", "doppel " + facts.version, "", ""});
  if (facts.page_is_built) {
    out.push_back({Level::ok, "program", "page", "the page is built", "", ""});
  } else {
    out.push_back({Level::note, "program", "page",
                   fmt::format("the page is not in {}", facts.page_folder.string()),
                   "the browser shows a plain page with links in its place; Foxglove and the verbs work",
                   "in a checkout: tools/build_page (it needs npm)"});
  }
  const bool none_loads = std::ranges::none_of(facts.engines, [](const ProgramFacts::Engine& engine) {
    return engine.is_built && engine.failure.empty();
  });
  for (const ProgramFacts::Engine& engine : facts.engines) out.push_back(judge_engine(engine, none_loads));
  if (facts.engines.empty()) {
    out.push_back({Level::problem, "engines", "engine", "no physics engine is known",
                   "`doppel up` cannot simulate", "install doppel again"});
  }
  return out;
}

}  // namespace doppel::doctor
