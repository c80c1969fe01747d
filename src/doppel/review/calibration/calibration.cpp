#include "doppel/review/calibration/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/base/math/units.h"

namespace doppel {
namespace {

constexpr double kWorstResidual = 5.0 * kDegree;
constexpr double kMinMotion = 0.05;  // machine per model: less means that the joint did not move
constexpr double kMinScale = 0.5, kMaxScale = 2.0;
constexpr double kZeroTolerance = 1e-9;  // rad or m

bool slides(const Joint& joint) {
  return joint.type == JointType::prismatic;
}

// In degrees or millimetres, the units of the text form.
std::string shown(const Joint& joint, double value) {
  return slides(joint) ? fmt::format("{:.4g} mm", value * 1e3) : fmt::format("{:.4g} deg", value / kDegree);
}

[[noreturn]] void refuse(const Joint& joint, std::string rule, const std::string& message, std::string fix) {
  throw InputError(std::move(rule), joint.source, fmt::format("'{}': {}", joint.name, message),
                   std::move(fix));
}

void check_joint(const Joint& joint) {
  if (joint.mimic) {
    refuse(joint, "calibrate.mimic", fmt::format("it mimics '{}' and has no servo", joint.mimic->joint),
           "measure the mimicked joint");
  }
  const bool one_number =
      joint.type == JointType::revolute || joint.type == JointType::continuous || slides(joint);
  if (!one_number) {
    refuse(joint, "calibrate.no_position", "a joint of this type has no position to measure",
           "measure revolute, continuous and prismatic joints");
  }
}

double least_spread(const Joint& joint) {
  if (!slides(joint)) return kMinSpread;
  return joint.limits ? (joint.limits->upper - joint.limits->lower) / 3.0 : 0.0;
}

struct Line {
  double slope = 0, offset = 0, worst = 0;
};

// Least squares, with the model's positions as exact: they are typed from a drawing, the machine's are
// read.
Line line_through(std::span<const Measurement> measurements) {
  const auto n = static_cast<double>(measurements.size());
  double model = 0, machine = 0, variance = 0, covariance = 0;
  for (const Measurement& m : measurements) {
    model += m.model / n;
    machine += m.machine / n;
  }
  for (const Measurement& m : measurements) {
    variance += (m.model - model) * (m.model - model);
    covariance += (m.model - model) * (m.machine - machine);
  }
  Line line;
  line.slope = covariance / variance;
  line.offset = machine - line.slope * model;
  for (const Measurement& m : measurements)
    line.worst = std::max(line.worst, std::abs(m.machine - (line.slope * m.model + line.offset)));
  return line;
}

// The machine's positions shifted by whole turns, if only then they are on a line of slope 1 or -1.
std::vector<double> unwrapped(const Joint& joint, std::span<const Measurement> measurements) {
  constexpr double kTurn = 2 * std::numbers::pi;
  if (slides(joint)) return {};
  for (const int direction : {1, -1}) {
    std::vector<Measurement> tried(measurements.begin(), measurements.end());
    // From the smallest value, so that 350 becomes -10 and not 80 becomes 440.
    const Measurement from = *std::ranges::min_element(tried, {}, &Measurement::machine);
    bool turned = false;
    for (Measurement& m : tried) {
      const double expected = from.machine + direction * (m.model - from.model);
      const double turns = std::round((expected - m.machine) / kTurn);
      m.machine += turns * kTurn;
      turned = turned || turns != 0;
    }
    const Line line = line_through(tried);
    if (!turned || line.worst > kWorstResidual || std::abs(line.slope - direction) > 0.1) continue;
    std::vector<double> out;
    for (const Measurement& m : tried) out.push_back(m.machine);
    return out;
  }
  return {};
}

// "write 0=-10 90=80"
std::string turn_hint(const Joint& joint, std::span<const Measurement> measurements) {
  const std::vector<double> machine = unwrapped(joint, measurements);
  if (machine.empty()) return "";
  std::string pairs;
  for (std::size_t i = 0; i < machine.size(); ++i)
    pairs += fmt::format(" {:.6g}={:.6g}", measurements[i].model / kDegree, machine[i] / kDegree);
  return fmt::format(
      "does the machine count from 0 to 360 degrees? Across the wrap, subtract or add 360: \"{}:{}\"; ",
      joint.name, pairs);
}

}  // namespace

double JointFit::worst_residual() const {
  double worst = 0;
  for (const double residual : residuals) worst = std::max(worst, std::abs(residual));
  return worst;
}

void check_spread(const Joint& joint, std::span<const Measurement> measurements) {
  if (measurements.size() < 2) {
    refuse(joint, "calibrate.too_few",
           fmt::format("{} measurement{} cannot separate the zero from the direction: an offset, or a "
                       "reversed direction with another offset, explain the data equally well",
                       measurements.size(), measurements.size() == 1 ? "" : "s"),
           "measure at two poses at least 60 degrees apart");
  }
  const auto [low, high] =
      std::minmax_element(measurements.begin(), measurements.end(),
                          [](const auto& a, const auto& b) { return a.model < b.model; });
  // The error of the slope is that of a reading over the spread, which is therefore the measure of what can
  // be told apart.
  const double spread = high->model - low->model, least = least_spread(joint);
  if (spread < least - 1e-9 || spread <= 0) {
    refuse(
        joint, "calibrate.too_close",
        fmt::format(
            "the measurements are {} apart; with less than {} between them a reading error changes the scale",
            shown(joint, spread), shown(joint, least)),
        "measure at poses further apart");
  }
}

JointFit fit_joint(const Joint& joint, std::span<const Measurement> measurements) {
  check_joint(joint);
  check_spread(joint, measurements);
  const Line line = line_through(measurements);
  const double slope = line.slope;
  if (std::abs(slope) < kMinMotion) {
    refuse(joint, "calibrate.no_motion",
           "the machine positions hardly differ, although the model positions do",
           "check that this is the joint that was moved");
  }
  // A wrong unit or a forgotten gear ratio is far from 1, a wrong pulse range of a servo within a factor of
  // 2.
  if (std::abs(slope) < kMinScale || std::abs(slope) > kMaxScale) {
    refuse(
        joint, "calibrate.scale",
        fmt::format("the machine moves {:.4g} times as far as the model, which no servo pulse range explains",
                    std::abs(slope)),
        turn_hint(joint, measurements) +
            "give both positions in the same unit; divide a motor angle by the gear ratio");
  }
  JointFit fit;
  fit.joint = joint.name;
  fit.direction = slope < 0 ? -1 : 1;
  fit.scale = std::abs(slope);
  fit.offset = line.offset;
  if (std::abs(fit.scale - 1.0) > kScaleTolerance) fit.unwrapped = unwrapped(joint, measurements);
  for (const Measurement& m : measurements)
    fit.residuals.push_back(m.machine - (slope * m.model + fit.offset));
  if (!slides(joint) && fit.worst_residual() > kWorstResidual) {
    refuse(joint, "calibrate.inconsistent",
           fmt::format("the measurements are not on one line: one deviates by {}",
                       shown(joint, fit.worst_residual())),
           turn_hint(joint, measurements) +
               "measure again; did the joint slip, or does one position belong to another joint?");
  }
  return fit;
}

namespace {

// A machine may count several turns; the unit distinguishes them from degrees.
std::vector<LargeAngle> large_angles(const OperationAction& action, const char* unit) {
  std::vector<LargeAngle> out;
  const auto note = [&](const char* key, double value) {
    if (std::abs(value) > 2 * std::numbers::pi) out.push_back({key, value, unit});
  };
  if (const auto* zero = std::get_if<BakeZero>(&action)) note("offset", zero->offset);
  if (const auto* limit = std::get_if<SetLimit>(&action)) {
    note("lower", limit->lower.value_or(0));
    note("upper", limit->upper.value_or(0));
  }
  return out;
}

}  // namespace

std::vector<Operation> calibration_operations(const Joint& joint, const JointFit& fit,
                                              std::span<const Measurement> measurements, LimitChoice limits) {
  std::vector<std::string> evidence;
  for (const Measurement& m : measurements)
    evidence.push_back(fmt::format("model {}, machine {}", shown(joint, m.model), shown(joint, m.machine)));
  std::vector<Operation> out;
  const auto add = [&](OperationAction action, std::string why) {
    Operation operation;
    operation.action = std::move(action);
    operation.beyond_a_turn = large_angles(operation.action, slides(joint) ? "m" : "rad");
    operation.why = std::move(why);
    operation.evidence = evidence;
    out.push_back(std::move(operation));
  };
  if (fit.direction < 0) add(FlipAxis{joint.name}, "the machine turns the other way");
  // The scale is corrected in the driver, so the zero is the machine's position in the model's scale.
  const double zero = fit.offset / fit.scale;
  if (std::abs(zero) > kZeroTolerance) {
    add(BakeZero{joint.name, zero},
        fmt::format("the machine reads {} where the model is at zero", shown(joint, fit.offset)));
  }
  const bool limited = joint.limits && joint.limits->has_position && joint.type != JointType::continuous;
  if (limits == LimitChoice::move && limited && !out.empty()) {
    // A flipped axis exchanges the limits, so that they are sorted again.
    const double a = fit.direction * joint.limits->lower + zero,
                 b = fit.direction * joint.limits->upper + zero;
    SetLimit moved;
    moved.joint = joint.name;
    moved.lower = std::min(a, b);
    moved.upper = std::max(a, b);
    add(moved, "the stops keep their physical positions and get machine values");
  }
  return out;
}

namespace {

double number(std::string_view text, const std::string& whole) {
  if (const auto value = measured_number(text)) return *value;
  throw InputError("calibrate.measure", {}, fmt::format("'{}' in '{}' is not a number", text, whole),
                   "write JOINT: MODEL=MACHINE MODEL=MACHINE, for example \"Revolute 2: 0=45 90=135\"");
}

}  // namespace

std::optional<double> measured_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    return {};
  return value;
}

NamedMeasurements parse_measurements(const std::string& text, const RobotDescription& robot) {
  const std::size_t colon = text.rfind(':');
  const auto form = [&](const std::string& what) {
    return InputError("calibrate.measure", {}, fmt::format("'{}' {}", text, what),
                      "write JOINT: MODEL=MACHINE MODEL=MACHINE, for example \"Revolute 2: 0=45 90=135\"");
  };
  if (colon == std::string::npos) throw form("has no joint name");
  NamedMeasurements out;
  out.joint = text.substr(0, colon);
  const Joint* joint = robot.find_joint(out.joint);
  if (joint == nullptr) {
    std::vector<std::string> names;
    for (const Joint& j : robot.joints) names.push_back(j.name);
    throw InputError("calibrate.joint", {},
                     fmt::format("the robot has no joint '{}'{}", out.joint, did_you_mean(out.joint, names)));
  }
  const double unit = slides(*joint) ? 1e-3 : kDegree;
  std::string_view rest = std::string_view(text).substr(colon + 1);
  while (true) {
    const std::size_t begin = rest.find_first_not_of(" \t,");
    if (begin == std::string_view::npos) break;
    const std::size_t end = std::min(rest.find_first_of(" \t,", begin), rest.size());
    const std::string_view pair = rest.substr(begin, end - begin);
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos)
      throw form(fmt::format("has '{}', which is not of the form MODEL=MACHINE", pair));
    out.measurements.push_back(
        {number(pair.substr(0, equals), text) * unit, number(pair.substr(equals + 1), text) * unit});
    rest.remove_prefix(end);
  }
  if (out.measurements.empty()) throw form("contains no measurement");
  return out;
}

}  // namespace doppel
