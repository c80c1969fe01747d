#include <algorithm>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/review/audit/detail/controllers.h"
#include "doppel/review/audit/detail/ros_rules.h"

namespace doppel::audit_rules {
namespace {

// Reported by rules of the audit, with more context.
bool reported_elsewhere(const std::string& rule) {
  static const Names kRules{"control.unknown_joint", "control.joint_twice", "control.joint_not_driven",
                            "control.mimic_joint"};
  return contains(kRules, rule);
}

// Parameters that ROS 2's controllers have and that no on_init() of doppel declares.
bool of_ros2_only(std::string_view name) {
  constexpr std::string_view kNames[] = {"type",
                                         "update_rate",
                                         "is_async",
                                         "use_sim_time",
                                         "thread_priority",
                                         "async_parameters",
                                         "fallback_controllers"};
  for (const std::string_view known : kNames) {
    if (name == known || (name.starts_with(known) && name.size() > known.size() && name[known.size()] == '.'))
      return true;
  }
  // The PID's earlier name of antiwindup_strategy, which ROS 2 still takes.
  return name.starts_with("qos_overrides.") || name.ends_with(".antiwindup");
}

bool whole_number_for_decimal(const ParameterValue& written, const ParameterValue& declared) {
  const bool one = std::holds_alternative<std::int64_t>(written) && std::holds_alternative<double>(declared);
  const bool list = std::holds_alternative<std::vector<std::int64_t>>(written) &&
                    std::holds_alternative<std::vector<double>>(declared);
  return one || list;
}

void check_whole_numbers(const DeclaredController& c, const Parameters& parameters, Findings& out) {
  Names names;
  SourceLocation where;
  std::string first;
  for (const ParameterOverride& o : c.parameters.all()) {
    const Parameters::Declared* declared = parameters.find(o.name);
    if (declared == nullptr || !whole_number_for_decimal(o.value, declared->value)) continue;
    if (names.empty()) {
      where = o.source;
      first = to_string(o.value);
    }
    names.push_back(o.name);
  }
  if (names.empty()) return;
  out.add("controllers.whole_number", c.subject(), where,
          fmt::format("{} {} written as an integer, but ROS 2 accepts only a double there",
                      quoted_list(names, 4), names.size() == 1 ? "is" : "are"),
          fmt::format("write {}.0", first));
}

// `complete`: every parameter was declared. Otherwise an unknown name may be one that is declared later.
void check_unknown(const DeclaredController& c, const Parameters& parameters, bool complete, Findings& out) {
  if (!complete || c.has_other_files) return;
  const Names valid = parameters.names();
  for (const ParameterOverride& o : c.parameters.all()) {
    if (o.used || of_ros2_only(o.name) || parameters.find(o.name) != nullptr) continue;
    out.add("controllers.unknown_parameter", c.subject(), o.source,
            fmt::format("{} has no parameter '{}', so this value has no effect{}", c.type, o.name,
                        did_you_mean(o.name, valid)),
            "correct the name, or remove it");
  }
}

// A base's odometry whose variances are all zero, the default of ros2_controllers.
void check_covariance(const DeclaredController& c, const Parameters& parameters, Findings& out) {
  for (const char* name : {"pose_covariance_diagonal", "twist_covariance_diagonal"}) {
    const Parameters::Declared* declared = parameters.find(name);
    if (declared == nullptr) continue;
    const auto& variances = std::get<std::vector<double>>(declared->value);
    if (!std::all_of(variances.begin(), variances.end(), [](double v) { return v == 0; })) continue;
    const auto written = std::find_if(c.parameters.all().begin(), c.parameters.all().end(),
                                      [&](const ParameterOverride& o) { return o.name == name; });
    const bool by_default = written == c.parameters.all().end();
    out.add("controllers.zero_covariance", c.subject(), by_default ? c.where : written->source,
            fmt::format("'{}' is all zero{}", name, by_default ? ", the default" : ""),
            fmt::format("write {}: [0.001, 0.001, 0.001, 0.001, 0.001, 0.01], or measured variances", name));
  }
}

}  // namespace

void check_parameters(const AuditInput& in, const ControllersFile& file, DeclaredController& c,
                      const ControllerRegistry::Type& type, Findings& out) {
  if (in.model == nullptr || c.parameters.all().empty()) return;
  Bus bus;
  Node node(bus, "/" + c.name);
  const Log log;
  ControllerContext context{c.name, &node, in.model, &log, &c.parameters, file.update_rate, c.type};
  bool complete = true;
  try {
    type.make()->on_init(context);
  } catch (const InputError& error) {
    complete = false;
    for (const Diagnostic& d : error.diagnostics()) {
      if (reported_elsewhere(d.rule)) continue;
      out.add("controllers.parameter", file.named ? Severity::error : Severity::warning, c.subject(), d.where,
              d.message, d.fix);
    }
  }
  if (!file.of_ros1) check_whole_numbers(c, node.parameters(), out);  // roscpp converts integers
  check_covariance(c, node.parameters(), out);
  check_unknown(c, node.parameters(), complete, out);
}

}  // namespace doppel::audit_rules
