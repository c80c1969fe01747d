#include "doppel/control/manager/joint_list.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"

namespace doppel {
namespace {

std::string unfit_for_commands(const ModelJoint& joint) {
  switch (joint.type) {
    case JointType::fixed:
      return "is fixed and cannot be driven";
    case JointType::floating:
      return "is floating; no actuator drives six degrees of freedom";
    case JointType::planar:
      return "is planar; no actuator drives three degrees of freedom";
    default:
      return "";
  }
}

// "CONTROLLER/JOINT" or "CONTROLLER/linear": a chainable controller's reference. It is checked by the switch, when
// both controllers are loaded. In a robot whose joints have names with a slash only the first form is accepted,
// so that a misspelt joint is found here.
bool is_reference(const Model& model, const std::string& name) {
  const std::size_t slash = name.find('/');
  if (slash == std::string::npos || slash == 0) return false;
  if (model.find_joint(name.substr(slash + 1)) >= 0) return true;
  return std::none_of(model.joints.begin(), model.joints.end(),
                      [](const ModelJoint& joint) { return joint.name.find('/') != std::string::npos; });
}

}  // namespace

SourceLocation place_of(const ControllerContext& context, std::string_view parameter, std::size_t index) {
  if (context.overrides == nullptr) return {};
  const ParameterOverride* found = context.overrides->find(parameter);
  if (found == nullptr) {
    // A missing parameter has no place; another value of the controller leads to its section in the file.
    const auto& all = context.overrides->all();
    const auto written = std::ranges::find_if(all, [](const auto& o) { return o.source.known(); });
    return written != all.end() ? written->source : SourceLocation();
  }
  return index < found->elements.size() ? found->elements[index] : found->source;
}

void log_diagnostic(const Log& log, const std::string& origin, const Diagnostic& finding) {
  std::string text = finding.where.known() ? finding.where.str() + ": " : "";
  text += finding.message;
  if (!finding.rule.empty()) text += fmt::format(" [{}]", finding.rule);
  if (!finding.fix.empty()) text += fmt::format("\n  fix: {}", finding.fix);
  log.line(finding.severity, origin, std::move(text));
}

std::vector<std::string> check_joints(const ControllerContext& context, const std::string& parameter,
                                      const std::vector<std::string>& names, JointUse use) {
  const Model& model = *context.model;
  std::vector<std::string> remaining;
  std::vector<Diagnostic> errors;
  const auto refuse = [&](std::size_t i, const char* rule, std::string message, std::string fix) {
    errors.push_back(
        {Severity::error, rule, std::move(message), place_of(context, parameter, i), std::move(fix)});
  };
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string& name = names[i];
    if (std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(i), name) !=
        names.begin() + static_cast<std::ptrdiff_t>(i)) {
      refuse(i, "control.joint_twice",
             fmt::format("controller '{}' lists joint '{}' twice", context.name, name), "remove one of them");
      continue;
    }
    const int index = model.find_joint(name);
    if (index < 0 && use == JointUse::commanded && is_reference(model, name)) {
      remaining.push_back(name);
      continue;
    }
    if (index < 0) {
      const auto candidates = model.scalar_joint_names();
      refuse(i, "control.unknown_joint",
             fmt::format("controller '{}' lists joint '{}', which the robot '{}' does not have{}",
                         context.name, name, model.name, did_you_mean(name, candidates)),
             fmt::format("correct the name in '{}', or add the joint to the description", parameter));
      continue;
    }
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(index)];
    if (use == JointUse::commanded) {
      if (const std::string why = unfit_for_commands(joint); !why.empty()) {
        refuse(i, "control.joint_not_driven",
               fmt::format("controller '{}' lists joint '{}', which {}", context.name, name, why),
               fmt::format("remove it from '{}'", parameter));
        continue;
      }
      if (joint.mimics()) {
        const std::string& leader = model.joints[static_cast<std::size_t>(joint.mimic_leader)].name;
        log_diagnostic(*context.log, context.name,
                       {Severity::warning, "control.mimic_joint",
                        fmt::format("joint '{}' mimics '{}' and has no actuator; '{}' does not command it",
                                    name, leader, context.name),
                        place_of(context, parameter, i),
                        fmt::format("remove it from '{}'; it mimics '{}' automatically", parameter, leader)});
        continue;
      }
    }
    remaining.push_back(name);
  }
  if (!errors.empty()) throw InputError(std::move(errors));
  return remaining;
}

}  // namespace doppel
