#include "doppel/control/hardware/hardware_params.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"

namespace doppel {

HardwareParams::HardwareParams(std::string what, std::vector<PlacedParam> params,
                               std::vector<std::string> names, Diagnostics& errors)
    : what_(std::move(what)), params_(std::move(params)), errors_(errors) {
  for (const PlacedParam& one : params_) {
    if (std::ranges::find(names, one.name) == names.end())
      report_problem(one.name,
                     fmt::format("unknown <param> '{}'{}", one.name, did_you_mean(one.name, names)));
  }
}

const PlacedParam* HardwareParams::find(std::string_view name) const {
  const auto found = std::ranges::find(params_, name, &PlacedParam::name);
  return found == params_.end() ? nullptr : &*found;
}

SourceLocation HardwareParams::where(const std::string& name) const {
  const PlacedParam* const found = find(name);
  return found != nullptr ? found->where : params_.empty() ? SourceLocation{} : params_.front().where;
}

void HardwareParams::report_problem(const std::string& name, const std::string& why) {
  errors_.error("hardware.parameter", where(name), fmt::format("{}: {}", what_, why), "correct it");
}

double HardwareParams::number(const std::string& name, double otherwise, double least, double most) {
  const PlacedParam* const param = find(name);
  if (param == nullptr) return otherwise;
  const std::optional<double> value = parse_number(param->value);
  if (value && *value >= least && *value <= most) return *value;
  const std::string range = std::isfinite(most) ? fmt::format("from {:g} to {:g}", least, most)
                                                : fmt::format("of at least {:g}", least);
  report_problem(name,
                 fmt::format("<param> '{}' is '{}', but must be a number {}", name, param->value, range));
  return otherwise;
}

int HardwareParams::whole(const std::string& name, int otherwise, int least, int most) {
  const double value = number(name, otherwise, least, most);
  if (value == std::floor(value)) return static_cast<int>(value);
  report_problem(name, fmt::format("<param> '{}' is '{}', but must be a whole number", name, text(name)));
  return otherwise;
}

bool HardwareParams::flag(const std::string& name, bool otherwise) {
  return choice(name, {"false", "true"}, otherwise ? 1 : 0) == 1;
}

std::size_t HardwareParams::choice(const std::string& name, const std::vector<std::string>& options,
                                   std::size_t otherwise) {
  const PlacedParam* const param = find(name);
  if (param == nullptr) return otherwise;
  const auto found = std::ranges::find(options, param->value);
  if (found != options.end()) return static_cast<std::size_t>(found - options.begin());
  report_problem(name, fmt::format("<param> '{}' is '{}'{}; it can be {}", name, param->value,
                                   did_you_mean(param->value, options), fmt::join(options, ", ")));
  return otherwise;
}

std::string HardwareParams::text(const std::string& name, const std::string& otherwise) const {
  const PlacedParam* const param = find(name);
  return param == nullptr ? otherwise : param->value;
}

std::vector<PlacedParam> placed_params(const std::vector<std::pair<std::string, std::string>>& params,
                                       const SourceLocation& where) {
  std::vector<PlacedParam> out;
  for (const auto& [name, value] : params) out.push_back({name, value, where});
  return out;
}

}  // namespace doppel
