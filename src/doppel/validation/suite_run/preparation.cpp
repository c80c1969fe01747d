#include "doppel/validation/suite_run/preparation.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"

namespace doppel {

Suite suite_of(const Subject& subject, const std::filesystem::path& file) {
  if (!file.empty()) return load_suite(file);
  const std::filesystem::path beside = subject.validation_folder() / "suite.yaml";
  return std::filesystem::exists(beside) ? load_suite(beside) : Suite{};
}

void check_names(const Subject& subject, const Suite& suite, const std::string& joint) {
  if (subject.model == nullptr) return;
  const std::vector<std::string> joints = subject.model->driven_joint_names(),
                                 links = subject.model->link_names();
  const auto check = [](const std::string& name, const std::vector<std::string>& all, const char* kind,
                        const std::filesystem::path& file) {
    if (name.empty() || std::ranges::find(all, name) != all.end()) return;
    throw InputError("suite.unknown_name", file.empty() ? SourceLocation{} : make_location(file.string()),
                     fmt::format("the robot has no {} '{}'{}", kind, name, did_you_mean(name, all)),
                     "doppel tree lists links and joints");
  };
  check(joint, joints, "driven joint", {});
  check(suite.tool.link, links, "link", suite.file);
  if (suite.workspace) check(suite.workspace->frame, links, "link", suite.file);
  for (const auto& [name, limits] : suite.joint_steps) check(name, joints, "driven joint", suite.file);
  for (const auto& [pose, positions] : suite.poses) {
    for (const auto& [name, position] : positions) check(name, joints, "driven joint", suite.file);
  }
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  localtime_r(&now, &parts);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", &parts);
  return text;
}

}  // namespace doppel
