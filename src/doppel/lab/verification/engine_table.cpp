#include "doppel/lab/verification/engine_table.h"

#include <fmt/format.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "doppel/physics/contract/engine_modules.h"

namespace doppel {
namespace {

using Json = nlohmann::ordered_json;

struct Capability {
  const char *key, *text;
  bool EngineCapabilities::*has;
};
constexpr Capability kCapabilities[] = {
    {"contacts", "contacts", &EngineCapabilities::contacts},
    {"rays", "rays", &EngineCapabilities::rays},
    {"floating", "floating joints", &EngineCapabilities::floating},
    {"planar", "planar joints", &EngineCapabilities::planar},
    {"mimics", "`<mimic>`", &EngineCapabilities::mimics},
    {"friction", "joint friction", &EngineCapabilities::friction},
    {"stops", "stops with a stiffness", &EngineCapabilities::stops},
    {"ideal", "ideal servos", &EngineCapabilities::ideal},
    {"bounce", "contacts with a restitution", &EngineCapabilities::bounce},
};

struct Tolerance {
  const char *key, *text, *unit;
  double EngineTolerances::*value;
};
constexpr Tolerance kTolerances[] = {
    {"period", "period of a pendulum", "relative", &EngineTolerances::period},
    {"free_fall", "free fall after 1 s, beside the integrator's own error", "m",
     &EngineTolerances::free_fall},
    {"holding", "effort to hold a pose", "relative", &EngineTolerances::holding},
    {"sag", "sag of a held joint", "relative", &EngineTolerances::sag},
    {"stiction", "velocity of a joint held by friction", "rad/s", &EngineTolerances::stiction},
    {"mimic", "mimic error under load", "rad or m", &EngineTolerances::mimic},
    {"penetration", "penetration depth of a resting body of 1 kg", "m", &EngineTolerances::penetration},
};

std::string integrators_of(const EngineCapabilities& engine) {
  std::string out;
  for (const Integrator integrator : engine.integrators)
    out += (out.empty() ? "" : ", ") + std::string(name_of(integrator));
  return out;
}

std::vector<EngineCapabilities> available() {
  std::vector<EngineCapabilities> out;
  for (const KnownEngine& engine : known_engines()) {
    if (engine.available) out.push_back(engine_module(engine.name).capabilities);
  }
  return out;
}

std::string row(const std::string& first, const std::vector<EngineCapabilities>& engines,
                const std::function<std::string(const EngineCapabilities&)>& cell) {
  std::string out = "| " + first + " |";
  for (const EngineCapabilities& engine : engines) out += " " + cell(engine) + " |";
  return out + "\n";
}

std::string head(const std::string& first, const std::vector<EngineCapabilities>& engines) {
  std::string out =
      row(first, engines, [](const EngineCapabilities& of) { return of.name + " " + of.version; });
  out += "|---|";
  for (std::size_t i = 0; i < engines.size(); ++i) out += "---|";
  return out + "\n";
}

}  // namespace

std::string engines_text() {
  std::string out;
  for (const KnownEngine& engine : known_engines()) {
    if (!engine.available) {
      out += fmt::format("{:<8}  not built here: install {} and build again\n", engine.name, engine.package);
      continue;
    }
    const EngineCapabilities& can = engine_module(engine.name).capabilities;
    std::string has, lacks;
    for (const Capability& capability : kCapabilities) {
      std::string& list = can.*capability.has ? has : lacks;
      list += (list.empty() ? "" : ", ") + std::string(capability.key);
    }
    out += fmt::format("{:<8}  {:<7}{}\n", can.name, can.version,
                       engine.name == kDefaultEngine ? "  (default)" : "");
    out += fmt::format("{:<10}has {}\n", "", has);
    if (!lacks.empty()) out += fmt::format("{:<10}lacks {}\n", "", lacks);
    out += fmt::format("{:<10}integrators {}\n", "", integrators_of(can));
  }
  return out;
}

std::string engines_json() {
  Json out{{"version", 1}, {"engines", Json::array()}};
  for (const KnownEngine& engine : known_engines()) {
    Json entry{
        {"name", engine.name}, {"available", engine.available}, {"default", engine.name == kDefaultEngine}};
    entry["package"] = engine.package;
    if (engine.available) {
      const EngineCapabilities& can = engine_module(engine.name).capabilities;
      entry["version"] = can.version;
      for (const Capability& capability : kCapabilities)
        entry["capabilities"][capability.key] = can.*capability.has;
      for (const Integrator integrator : can.integrators) entry["integrators"].push_back(name_of(integrator));
      for (const Tolerance& tolerance : kTolerances)
        entry["tolerances"][tolerance.key] = can.tolerances.*tolerance.value;
    }
    out["engines"].push_back(std::move(entry));
  }
  return out.dump(2) + "\n";
}

std::string engines_markdown() {
  const std::vector<EngineCapabilities> engines = available();
  std::string out = head("can", engines);
  for (const Capability& capability : kCapabilities)
    out += row(capability.text, engines,
               [&](const EngineCapabilities& of) { return std::string(of.*capability.has ? "yes" : "no"); });
  out += row("integrators", engines, integrators_of);
  out += "\n" + head("differs from the closed form by at most", engines);
  for (const Tolerance& tolerance : kTolerances)
    out += row(
        fmt::format("{}, {}", tolerance.text, tolerance.unit), engines,
        [&](const EngineCapabilities& of) { return fmt::format("{:g}", of.tolerances.*tolerance.value); });
  return out;
}

}  // namespace doppel
