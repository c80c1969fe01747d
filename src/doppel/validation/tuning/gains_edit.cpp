// New gains in the text of a controllers' file.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "doppel/ros/bus/parameter_edit.h"
#include "doppel/ros/bus/parameter_file.h"
#include "doppel/validation/tuning/tune.h"

namespace doppel {
namespace {

// A double in the file, also where it is a whole number: ROS 2 refuses an integer for it.
std::string as_double(double value) {
  std::string out = fmt::format("{:.4g}", value);
  if (out.find_first_of(".e") == std::string::npos) out += ".0";
  return out;
}

bool has_gains(const ParameterFile& file, const TunedJoint& joint) {
  const ParameterOverrides overrides = file.overrides_for("/" + joint.controller, joint.controller);
  const std::string prefix = "gains." + joint.joint + ".";
  return std::ranges::any_of(overrides.all(),
                             [&](const ParameterOverride& one) { return one.name.starts_with(prefix); });
}

}  // namespace

std::string with_new_gains(const std::string& text, const std::filesystem::path& file,
                           const TuneReport& report) {
  std::vector<NumberEdit> edits;
  const ParameterFile parameters = ParameterFile::parse(text, file.string());
  for (const TunedJoint& joint : report.joints) {
    if (!joint.design) continue;
    const LoopGains& gains = joint.design->gains;
    ParameterOverrides overrides = parameters.overrides_for("/" + joint.controller, joint.controller);
    const std::string prefix = "gains." + joint.joint + ".", p = prefix + "p";
    // A gain that is 0 and that the file does not have needs no line.
    const auto is_needed = [&](const std::string& name, double value) {
      return value != 0 || overrides.find(name) != nullptr;
    };
    if (overrides.find(p) == nullptr) {
      throw InputError(
          "tune.no_gains", make_location(file.string()),
          fmt::format("{} has no gains of {}", joint.controller, joint.joint),
          fmt::format("write below ros__parameters of {}: gains: {{{}: {{p: {}, i: {}, d: {}}}}}",
                      joint.controller, joint.joint, as_double(gains.p), as_double(gains.i),
                      as_double(gains.d)));
    }
    edits.push_back({joint.controller, p, as_double(gains.p), ""});
    // An integral's bound belongs to it; without one the file's bounds are removed.
    const bool bounded = std::isfinite(gains.clamp);
    const std::string low = prefix + "i_clamp_min", high = prefix + "i_clamp_max";
    const double bound = gains.clamp;
    if (bounded || overrides.find(low) != nullptr)
      edits.push_back({joint.controller, low, bounded ? as_double(-bound) : "-.inf", p});
    if (bounded || overrides.find(high) != nullptr)
      edits.push_back({joint.controller, high, bounded ? as_double(bound) : ".inf", p});
    // Each is added behind p, so that the last one of the list is the first one below it.
    if (is_needed(prefix + "d", gains.d))
      edits.push_back({joint.controller, prefix + "d", as_double(gains.d), p});
    if (is_needed(prefix + "i", gains.i))
      edits.push_back({joint.controller, prefix + "i", as_double(gains.i), p});
  }
  return with_numbers(text, file.string(), edits, "tune.not_editable");
}

std::filesystem::path gains_file(const Subject& subject, const TuneReport& report) {
  const auto& files = subject.robot().setup().controllers_files;
  for (auto file = files.rbegin(); file != files.rend(); ++file) {
    const ParameterFile parameters = ParameterFile::load(*file);
    const auto is_here = [&](const TunedJoint& joint) {
      return joint.design && has_gains(parameters, joint);
    };
    if (std::ranges::any_of(report.joints, is_here)) return *file;
  }
  return files.empty() ? std::filesystem::path() : files.back();
}

}  // namespace doppel
