#include "doppel/validation/statics/file_gates.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <sstream>

#include "doppel/base/core/output_file.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/sha256.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/urdf/urdf_writer.h"
#include "doppel/validation/statics/detail/audit_split.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

void print_links(const Model& model, int link, int depth, std::string& out) {
  for (const ModelJoint& joint : model.joints) {
    if (joint.parent_link != link) continue;
    const std::string& parent = model.links[static_cast<std::size_t>(link)].name;
    const std::string& child = model.links[static_cast<std::size_t>(joint.child_link)].name;
    std::string mimic;
    if (joint.mimics()) mimic = ", mimics " + model.joints[static_cast<std::size_t>(joint.mimic_leader)].name;
    out += fmt::format("{}{} ({}{}): {} -> {}\n", std::string(static_cast<std::size_t>(2 * depth), ' '),
                       joint.name, joint_type_name(joint.type), mimic, parent, child);
    print_links(model, joint.child_link, depth + 1, out);
  }
}

// The text of a package.xml's element, or "?".
std::string manifest_text(const fs::path& package, std::string_view element) {
  try {
    const XmlNode manifest = load_xml((package / "package.xml").string());
    const XmlNode* const node = manifest.first(element);
    return node == nullptr ? "?" : node->content();
  } catch (const InputError&) {
    return "?";  // the audit has a rule for it
  }
}

std::string hash_of(const std::vector<ReadFile>& files) {
  std::string all;
  for (const ReadFile& file : files) all += file.sha256 + "\n";
  return sha256_hex(all);
}

std::string without_indent(const std::string& line) {
  return line.substr(std::min(line.size(), line.find_first_not_of(' ')));
}

// The joints, each with its links, so that neither depth nor order counts: a link that is inserted above all
// others is one difference.
std::set<std::string> lines_of(const std::string& text) {
  std::set<std::string> out;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (!line.empty() && line.front() != '#') out.insert(without_indent(line));
  }
  return out;
}

// Adds what one tree has and the other has not.
void add_differences(const std::string& committed, const std::string& present, const fs::path& file,
                     CheckResult& out) {
  const std::set<std::string> before = lines_of(committed), after = lines_of(present);
  for (const std::string& line : before) {
    if (!after.contains(line))
      out.fail(line, fmt::format("is in {} and not in the description", file.filename().string()));
  }
  for (const std::string& line : after) {
    if (!before.contains(line))
      out.fail(line, fmt::format("is in the description and not in {}", file.filename().string()),
               fmt::format("if it is meant, remove {}: the next run writes it anew", file.string()));
  }
}

}  // namespace

std::string plain_tree(const Model& model) {
  std::string out = model.links.front().name + "\n";
  print_links(model, 0, 1, out);
  return out;
}

CheckResult check_origin(const CheckContext& context) {
  const Subject& subject = context.subject;
  CheckResult out = begin_result("G01");
  std::size_t applied = 0, operations = 0;
  for (const AppliedOverlay& overlay : subject.overlays) {
    for (std::size_t i = 0; i < overlay.outcomes.size(); ++i) {
      const OperationOutcome& outcome = overlay.outcomes[i];
      const Operation& operation = overlay.overlay.operations[i];
      ++operations;
      if (outcome.state == OperationState::applied || outcome.state == OperationState::already_there ||
          outcome.state == OperationState::superseded) {
        ++applied;
        continue;
      }
      out.fail(describe(operation.action),
               fmt::format("is not applied ({}): {}", to_string(outcome.state), outcome.message),
               fmt::format("doppel overlay {} lists the corrections; remove this one or stamp it anew",
                           subject.scenario.robots.front().target),
               operation.where);
    }
  }
  const fs::path& package = subject.target.package_folder;
  if (package.empty()) {
    out.notes.push_back("the description is in no ROS package, so that its origin and licence are not known");
  } else {
    out.notes.push_back(fmt::format("package {} {}, licence {}, maintainer {}",
                                    manifest_text(package, "name"), manifest_text(package, "version"),
                                    manifest_text(package, "license"), manifest_text(package, "maintainer")));
  }
  const std::string hash = hash_of(subject.files);
  out.notes.push_back("sha256 over all files: " + hash);
  out.summary =
      fmt::format("{} files, sha256 {}...{}", subject.files.size(), hash.substr(0, 12),
                  operations == 0 ? "" : fmt::format(", {} of {} corrections apply", applied, operations));
  return out;
}

CheckResult check_parsing(const CheckContext& context) {
  CheckResult out = begin_result("G02");
  add_findings(context.subject.audit, AuditPart::parsing, out);
  for (const Diagnostic& error : context.subject.refusal) {
    const bool is_reported = std::ranges::any_of(context.subject.audit.findings, [&](const Finding& finding) {
      return finding.rule == error.rule && finding.severity == Severity::error;
    });
    if (!is_reported) out.fail("", fmt::format("{} [{}]", error.message, error.rule), error.fix, error.where);
  }
  const std::size_t errors =
      static_cast<std::size_t>(std::ranges::count(out.items, Verdict::failed, &CheckItem::verdict));
  out.metrics.push_back({"errors", "", static_cast<double>(errors), "", 0.0});
  out.summary = errors == 0 ? fmt::format("{} links, {} joints", context.subject.audit.links,
                                          context.subject.audit.joints)
                            : fmt::format("{} error{} (limit 0)", errors, errors == 1 ? "" : "s");
  return out;
}

CheckResult check_tree(const CheckContext& context) {
  const Subject& subject = context.subject;
  CheckResult out = begin_result("G03");
  const fs::path file = subject.validation_folder() / "tree.txt";
  const std::string present = plain_tree(*subject.model);
  constexpr std::size_t kMaxTreeBytes = std::size_t{16} << 20;
  if (const FileContent committed = read_content(file, kMaxTreeBytes); committed.was_read()) {
    add_differences(committed.bytes, present, file, out);
    out.summary = out.items.empty() ? fmt::format("{} links as in {}", subject.model->links.size(),
                                                  file.filename().string())
                                    : fmt::format("{} differences from {}", out.items.size(), file.string());
    return out;
  }
  out.verdict = Verdict::not_judged;
  out.summary = "look at the tree (doppel tree) and commit " + file.string();
  if (!context.write_answers) return out;
  try {
    fs::create_directories(file.parent_path());
    write_whole(
        file,
        "# The tree as it was when somebody looked at it: doppel validate compares it (G03).\n" + present);
    out.notes.push_back("written: " + file.string());
  } catch (const std::exception& error) {
    out.notes.push_back(fmt::format("{} cannot be written: {}", file.string(), error.what()));
  }
  return out;
}

}  // namespace doppel
