#include "doppel/review/audit/detail/controllers.h"
#include "doppel/review/audit/detail/ros_rules.h"
#include "doppel/scenario/resolve/controllers_search.h"
#include "doppel/scenario/resolve/ros1_controllers.h"
#include "doppel/scenario/resolve/side_files.h"

namespace doppel::audit_rules {
namespace {

namespace fs = std::filesystem;

void report_unreadable(const fs::path& path, Severity severity, const Diagnostic& why, Findings& out) {
  out.add("controllers.unreadable", severity, path.filename().string(), why.where, why.message, why.fix);
}

// A file that the caller chose is always checked, whatever its content.
std::vector<ControllersFile> chosen_file(const AuditInput& in, const fs::path& path, Findings& out) {
  try {
    const std::string text = read_side_file(path).text;
    Diagnostics mapped;
    ControllersFile file = controllers_in(parse_controllers(text, path.string(), in.robot, mapped));
    file.named = true;
    return {std::move(file)};
  } catch (const InputError& error) {
    for (const Diagnostic& d : error.diagnostics()) {
      if (d.rule == "audit.skipped")
        out.add(d.rule, path.filename().string(), d.where, d.message, d.fix);
      else
        report_unreadable(path, Severity::error, d, out);
    }
    return {};
  }
}

// Other plugins have <parameters> too, which may be anything.
bool controls(const GazeboPlugin& plugin) {
  return find_gazebo_control_plugin(plugin.filename) != nullptr;
}

// Without its folder the package may be incomplete on this machine, so that a missing file is no proof.
void report_missing(const ControllersSearch::Missing& missing, Findings& out) {
  if (!controls(*missing.plugin)) return;
  out.add("controllers.file_missing", missing.folder_there ? Severity::error : Severity::warning,
          fmt::format("<gazebo> plugin '{}'", missing.plugin->filename), missing.plugin->source,
          fmt::format("its <parameters> is '{}', which does not exist{}", missing.file.string(),
                      missing.did_you_mean),
          "correct the path, or create the file");
}

}  // namespace

std::vector<ControllersFile> read_controllers(const AuditInput& in, Findings& out) {
  if (in.options.controllers) return chosen_file(in, *in.options.controllers, out);
  ControllersSearch found =
      find_controllers_files(in.robot, {in.expanded.file, in.options.package_folder}, in.resolver);
  for (const ControllersSearch::Missing& missing : found.missing) report_missing(missing, out);
  for (const ControllersSearch::Unusable& file : found.unusable) {
    if (file.plugin != nullptr && !controls(*file.plugin)) continue;
    const Severity severity = file.plugin != nullptr ? Severity::error : Severity::warning;
    for (const Diagnostic& why : file.why.all()) report_unreadable(file.file, severity, why, out);
  }
  report_skipped(found.skipped, out);
  if (found.files.empty() && found.of_another) found.files.push_back(std::move(*found.of_another));
  return std::move(found.files);
}

}  // namespace doppel::audit_rules
