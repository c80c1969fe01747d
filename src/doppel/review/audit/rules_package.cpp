// The package around a description: its package.xml, and whether the files that the description uses are in
// share/ when the package is built and installed.
#include <algorithm>
#include <initializer_list>
#include <map>
#include <set>

#include "doppel/base/core/text.h"
#include "doppel/review/audit/detail/package_files.h"
#include "doppel/review/audit/detail/ros_rules.h"
#include "doppel/review/audit/detail/vocabulary.h"
#include "doppel/scenario/resolve/side_files.h"

namespace doppel::audit_rules {
namespace {

namespace fs = std::filesystem;

struct Package {
  fs::path folder;
  PackageManifest manifest;
};

// Licences that permit nothing because they are not filled in, or exclude commercial use.
void check_licenses(const PackageManifest& manifest, Findings& out) {
  const auto has = [](const std::string& text, std::initializer_list<std::string_view> words) {
    const std::string low = lowered(text);
    return std::ranges::any_of(words,
                               [&](std::string_view word) { return low.find(word) != std::string::npos; });
  };
  const std::string subject = fmt::format("package '{}'", manifest.name);
  const bool unreleased = manifest.version == "0.0.0";  // the version of a new package; its licence may wait
  for (const PackageManifest::License& license : manifest.licenses) {
    if (license.text.empty() || has(license.text, {"todo", "license declaration", "tbd", "unknown"})) {
      if (unreleased) continue;
      out.add("package.license", subject, license.source,
              fmt::format("its licence is '{}', a placeholder, which permits no use and no distribution of "
                          "the model by others",
                          license.text),
              "write the SPDX identifier of the licence, for example Apache-2.0");
    } else if (has(license.text, {"noncommercial", "non-commercial", "by-nc", "research only", "academic"})) {
      out.add("package.license", subject, license.source,
              fmt::format("its licence '{}' excludes commercial use", license.text),
              "ask the authors, or use another model in a product");
    }
  }
}

std::optional<Package> read_package(const AuditInput& in, Findings& out) {
  const fs::path& folder = in.options.package_folder;
  try {
    Package package{folder, read_manifest(folder / "package.xml")};
    const PackageManifest& m = package.manifest;
    if (contains(m.missing, "name")) {
      out.add("package.invalid", "package.xml", m.source, "it has no <name>", "write the package's name");
      return std::nullopt;
    }
    if (!m.missing.empty()) {
      out.add("package.incomplete", fmt::format("package '{}'", m.name), m.source,
              fmt::format("package.xml lacks {}", quoted_list(m.missing)), "add what is missing");
    }
    check_licenses(m, out);
    return package;
  } catch (const InputError& error) {
    for (const Diagnostic& d : error.diagnostics()) {
      out.add(d.rule == "audit.skipped" ? d.rule : "package.invalid", "package.xml", d.where, d.message,
              d.fix);
    }
    return std::nullopt;
  }
}

// An incomplete package: build files beside the description's folder, and no package.xml.
void check_missing_manifest(const AuditInput& in, Findings& out) {
  const fs::path folder = in.expanded.folder().parent_path();
  std::error_code none;
  const bool setup = fs::exists(folder / "setup.py", none) && fs::exists(folder / "resource", none);
  std::string text;
  try {
    if (fs::exists(folder / "CMakeLists.txt", none)) text = read_side_file(folder / "CMakeLists.txt").text;
  } catch (const InputError& error) {
    report_skipped(error, out);
  }
  if (!setup && text.find("ament_package") == std::string::npos &&
      text.find("catkin_package") == std::string::npos)
    return;
  out.add("package.no_manifest", "the package",
          make_location((folder / (setup ? "setup.py" : "CMakeLists.txt")).string(), 1, 1),
          fmt::format("'{}' has a ROS build file but no package.xml", folder.string()),
          "write a package.xml with the package's name");
}

// $(find NAME) and package://NAME as the sources write them, with the first place of each.
void packages_in(const std::string& text, const SourceLocation& where,
                 std::map<std::string, SourceLocation>& out) {
  for (const auto& [open, ends] : {std::pair{"$(find ", ")"}, std::pair{"package://", "/\"' \n"}}) {
    for (std::size_t at = text.find(open); at != std::string::npos; at = text.find(open, at + 1)) {
      const std::size_t from = at + std::string_view(open).size();
      const std::size_t end = text.find_first_of(ends, from);
      std::string name = text.substr(from, end == std::string::npos ? end : end - from);
      std::erase(name, ' ');
      if (!name.empty() && name.find_first_of("${}()") == std::string::npos) out.emplace(name, where);
    }
  }
}

void packages_in(const XmlNode& node, std::map<std::string, SourceLocation>& out) {
  if (node.kind == XmlNode::Kind::text) packages_in(node.text, node.where, out);
  for (const XmlAttribute& attribute : node.attributes) packages_in(attribute.value, attribute.where, out);
  for (const XmlNode& child : node.children) packages_in(child, out);
}

std::map<std::string, SourceLocation> packages_named(const AuditInput& in) {
  std::map<std::string, SourceLocation> out;
  packages_in(in.expanded.root, out);
  for (const fs::path& file : in.expanded.files) {
    if (file.extension() == ".yaml" || file.extension() == ".yml") continue;
    try {
      packages_in(load_xml(file.string()), out);
    } catch (const InputError&) {
      continue;
    }
  }
  return out;
}

// Many packages share the last word of their name ("_description"), so only the rest is compared.
bool slip_of(std::string_view written, std::string_view own) {
  const std::size_t word = own.rfind('_');
  if (word != std::string_view::npos && written.ends_with(own.substr(word))) {
    written.remove_suffix(own.size() - word);
    own.remove_suffix(own.size() - word);
  }
  return is_near_certain_match(written, own);
}

void check_names(const AuditInput& in, const Package& package,
                 const std::map<std::string, SourceLocation>& named, Findings& out) {
  const std::string& own = package.manifest.name;
  const std::string folder = package.folder.filename().string();
  for (const auto& [name, where] : named) {
    if (name == own || !in.resolver.find_package(name).path.empty()) continue;
    if (name != folder && !slip_of(name, own)) continue;
    out.add("package.name_mismatch", fmt::format("package '{}'", name), where,
            fmt::format("there is no package '{}'; package.xml names this one '{}'{}", name, own,
                        name == folder ? ", and only its folder has that name" : ""),
            fmt::format("write {}, or rename the package", own));
  }
}

void check_dependencies(const Package& package, const std::map<std::string, SourceLocation>& named,
                        Findings& out) {
  const PackageManifest& m = package.manifest;
  for (const auto& [name, where] : named) {
    if (name == m.name || contains(m.dependencies, name) || name == package.folder.filename().string())
      continue;
    if (slip_of(name, m.name)) continue;  // a typo of its own name, reported above
    out.add("package.dependency", fmt::format("package '{}'", m.name), where,
            fmt::format("the description uses the package '{}', which package.xml does not depend on", name),
            fmt::format("add <exec_depend>{}</exec_depend> to {}", name, m.source.place()));
  }
}

// Files below the package that the description needs at run time, each with its purpose.
std::map<std::string, std::string> needed_files(const AuditInput& in, const fs::path& package) {
  std::map<std::string, std::string> out;
  const fs::path top = fs::absolute(package).lexically_normal();
  const auto take = [&](const fs::path& file, const char* what) {
    if (file.empty()) return;
    const fs::path relative = fs::absolute(file).lexically_normal().lexically_relative(top);
    if (relative.empty() || *relative.begin() == "..") return;
    out.emplace(relative.generic_string(), what);
  };
  for (const fs::path& file : in.expanded.files) take(file, "the description");
  const auto mesh = [&](const Geometry& geometry) {
    if (const auto* m = std::get_if<MeshGeometry>(&geometry)) take(m->path, "a mesh");
  };
  for (const Link& link : in.robot.links) {
    for (const Visual& visual : link.visuals) mesh(visual.geometry);
    for (const Collision& collision : link.collisions) mesh(collision.geometry);
  }
  std::error_code none;
  for (const GazeboExtension& gazebo : in.robot.gazebo) {
    for (const GazeboPlugin& plugin : gazebo.plugins) {
      for (const std::string& file : plugin.parameter_files) {
        if (fs::exists(file, none)) take(file, "the controllers' parameters");
      }
    }
  }
  return out;
}

void check_installed(const AuditInput& in, const Package& package, const InstallRules& rules, Findings& out) {
  if (!rules.understood) return;
  struct Left {
    std::string what, first;
    std::size_t count = 0;
    std::optional<std::string> elsewhere;
  };
  std::map<std::string, Left> left_out;  // by top folder
  for (const auto& [file, what] : needed_files(in, package.folder)) {
    const auto installed = rules.installed(file);
    if (installed && *installed == file) continue;
    // An overlay beside the description is doppel's own.
    if (file.ends_with(".overlay.yaml")) continue;
    const std::size_t slash = file.find('/');
    Left& left = left_out[slash == std::string::npos ? file : file.substr(0, slash)];
    if (left.count++ == 0) {
      left.what = what;
      left.first = file;
      left.elsewhere = installed;
    }
  }
  const bool cmake = rules.source.file->ends_with("CMakeLists.txt");
  for (const auto& [folder, left] : left_out) {
    const SourceLocation where = rules.paths.empty() ? rules.source : rules.paths.back().source;
    const std::string more = left.count > 1 ? fmt::format(" and {} more", left.count - 1) : "";
    if (left.elsewhere) {
      out.add(
          "package.installed_elsewhere", fmt::format("folder '{}'", folder), where,
          fmt::format("'{}'{} ({}) is installed as share/{}/{}, but the description does not use that path",
                      left.first, more, left.what, package.manifest.name, *left.elsewhere),
          "install the folder under its own name: remove the trailing slash");
      continue;
    }
    // With catkin a workspace runs from its sources, and many packages are never installed.
    const Severity severity = package.manifest.catkin ? Severity::note : Severity::warning;
    out.add("package.not_installed", severity, fmt::format("folder '{}'", folder), where,
            fmt::format("'{}'{} ({}) is not installed", left.first, more, left.what),
            cmake ? fmt::format("add it: install(DIRECTORY {} DESTINATION share/${{PROJECT_NAME}})", folder)
                  : fmt::format(
                        "add it to data_files: (os.path.join('share', package_name, '{0}'), glob('{0}/*'))",
                        folder));
  }
}

// Nothing for a build file that cannot be read, which is reported.
std::optional<InstallRules> read_rules(InstallRules (*read)(const fs::path&), const fs::path& file,
                                       Findings& out) {
  try {
    InstallRules rules = read(file);
    if (!rules.given_up.empty())
      out.add("audit.skipped", file.filename().string(), rules.given_up_source, rules.given_up);
    return rules;
  } catch (const InputError& error) {
    report_skipped(error, out);
    return std::nullopt;
  }
}

void check_project_name(const PackageManifest& m, const InstallRules& rules, Findings& out) {
  if (rules.project.empty() || rules.project.find('$') != std::string::npos || rules.project == m.name)
    return;
  out.add("package.project_name", fmt::format("package '{}'", m.name), rules.project_source,
          fmt::format("project({}) and package.xml's name '{}' differ", rules.project, m.name),
          fmt::format("write project({})", m.name));
}

void check_build(const AuditInput& in, const Package& package, Findings& out) {
  std::error_code none;
  const fs::path cmake = package.folder / "CMakeLists.txt", setup = package.folder / "setup.py";
  const PackageManifest& m = package.manifest;
  const std::string subject = fmt::format("package '{}'", m.name);
  if (fs::exists(cmake, none)) {
    if (const auto rules = read_rules(read_cmake, cmake, out)) {
      check_project_name(m, *rules, out);
      check_installed(in, package, *rules, out);
    }
    if (m.build_type == "ament_python") {
      out.add("package.build_type", subject, m.source,
              "build_type is ament_python, but there is a CMakeLists.txt",
              "write <build_type>ament_cmake</build_type>, or remove the CMakeLists.txt");
    }
  } else if (fs::exists(setup, none)) {
    if (const auto rules = read_rules(read_setup_py, setup, out)) check_installed(in, package, *rules, out);
    if (m.build_type != "ament_python") {
      out.add("package.build_type", subject, m.source,
              m.build_type.empty() ? "there is a setup.py and no build_type"
                                   : fmt::format("there is a setup.py, and build_type is {}", m.build_type),
              "write <export><build_type>ament_python</build_type></export>");
    }
  }
}

}  // namespace

void check_package(const AuditInput& in, Findings& out) {
  if (in.options.package_folder.empty()) {
    check_missing_manifest(in, out);
    return;
  }
  const auto package = read_package(in, out);
  if (!package) return;
  const auto named = packages_named(in);
  check_names(in, *package, named, out);
  check_dependencies(*package, named, out);
  check_build(in, *package, out);
  check_launch(in, package->manifest, out);
}

}  // namespace doppel::audit_rules
