#include "doppel/scenario/resolve/open_target.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/description/overlay/overlay.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

struct SimulationSwitch {
  std::string_view name;
  std::string_view simulates;  // the value that means simulation; empty: descriptions differ
};
constexpr SimulationSwitch kSwitches[] = {{"use_sim", "true"},
                                          {"sim_gazebo", "true"},
                                          {"use_gazebo", "true"},
                                          {"sim_gz", "true"},
                                          {"sim_ignition", "true"},
                                          {"sim_ign", ""},
                                          {"use_ignition", ""},
                                          {"is_sim", ""},
                                          {"sim", ""},
                                          {"sim_mode", ""},
                                          {"use_fake_hardware", ""},
                                          {"use_mock_hardware", ""},
                                          {"fake_hardware", ""},
                                          {"use_real_hardware", ""},
                                          {"simulation", ""},
                                          {"is_simulation", ""}};

}  // namespace

Target find_target(const std::string& word, const fs::path& bundled_robots, PackageResolver& resolver) {
  resolver.add_bundled(bundled_robots);
  Target target = resolve_target(word, bundled_robots);
  resolver.add_context(target.description);
  return target;
}

OpenedTarget open_target(const std::string& word, XacroArguments arguments, const fs::path& bundled_robots) {
  OpenedTarget out;
  out.target = find_target(word, bundled_robots, out.resolver);
  out.arguments = std::move(arguments);
  return out;
}

bool switches_simulation(std::string_view argument) {
  return std::any_of(std::begin(kSwitches), std::end(kSwitches),
                     [argument](const SimulationSwitch& one) { return one.name == argument; });
}

std::string hardware_argument(const XacroArguments& arguments) {
  for (const auto& [name, value] : arguments) {
    if (!switches_simulation(name)) continue;
    const bool on = value == "true" || value == "True" || value == "1";
    const bool off = value == "false" || value == "False" || value == "0";
    if (name == "use_real_hardware" ? on : off) return name + ":=" + value;
  }
  return {};
}

XacroArguments hardware_arguments(const fs::path& description, XacroArguments arguments,
                                  const PackageResolver& resolver) {
  const auto declared = declared_xacro_arguments(description, resolver);
  for (const auto& [name, value] : kSwitches) {
    if (value.empty()) continue;
    const auto has_name = [switch_name = std::string(name)](const auto& list, auto member) {
      return std::ranges::find(list, switch_name, member) != list.end();
    };
    if (!has_name(declared, &XacroArgumentDeclaration::name) ||
        has_name(arguments, &XacroArguments::value_type::first))
      continue;
    arguments.emplace_back(std::string(name), "false");
    break;
  }
  return arguments;
}

XacroArguments simulation_arguments(const fs::path& description, XacroArguments arguments,
                                    const PackageResolver& resolver, Diagnostics& diagnostics) {
  const auto declared = declared_xacro_arguments(description, resolver);
  for (const auto& [name, value] : kSwitches) {
    if (value.empty()) continue;
    const auto chosen = [&, wanted = std::string(name)](const auto& a) { return a.first == wanted; };
    const auto is = [&, wanted = std::string(name)](const auto& d) { return d.name == wanted; };
    const auto found = std::find_if(declared.begin(), declared.end(), is);
    if (found == declared.end() || std::any_of(arguments.begin(), arguments.end(), chosen)) continue;
    arguments.emplace_back(std::string(name), std::string(value));
    diagnostics.note(
        "up.use_sim", found->source,
        fmt::format("the description has an argument '{}', which is set to '{}' for simulation", name, value),
        fmt::format("pass {}:=... to choose otherwise", name));
    break;
  }
  return arguments;
}

ExpandedDescription expand_for_simulation(const fs::path& description, XacroArguments& arguments,
                                          PackageResolver& resolver, Diagnostics& diagnostics) {
  Diagnostics reported;
  XacroArguments simulated = simulation_arguments(description, arguments, resolver, reported);
  if (simulated.size() == arguments.size())
    return expand_corrected(description, arguments, resolver, diagnostics);
  try {
    ExpandedDescription out = expand_corrected(description, simulated, resolver, reported);
    for (const Diagnostic& d : reported.all()) diagnostics.add(d);
    arguments = std::move(simulated);
    return out;
  } catch (const InputError& problem) {
    ExpandedDescription out = expand_corrected(description, arguments, resolver, diagnostics);
    const Diagnostic& why = problem.diagnostics().front();
    diagnostics.note("up.use_sim", why.where,
                     fmt::format("the description cannot be expanded with {}:={}, which selects simulation; "
                                 "it is expanded without it. {}",
                                 simulated.back().first, simulated.back().second, why.message));
    return out;
  }
}

std::vector<fs::path> files_of(const Target& target, const LoadedDescription& description) {
  std::vector<fs::path> out = description.files;
  out.push_back(overlay_path(target.description));
  for (fs::path& beside : overlay_paths(description.files)) out.push_back(std::move(beside));
  const auto add = [&out](const Geometry& geometry) {
    const auto* mesh = std::get_if<MeshGeometry>(&geometry);
    if (mesh != nullptr && !mesh->path.empty()) out.emplace_back(mesh->path);
  };
  for (const Link& link : description.robot.links) {
    for (const Visual& visual : link.visuals) add(visual.geometry);
    for (const Collision& collision : link.collisions) add(collision.geometry);
  }
  return out;
}

}  // namespace doppel
