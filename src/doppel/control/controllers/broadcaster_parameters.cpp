#include "doppel/control/controllers/detail/broadcaster_parameters.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/control/manager/joint_list.h"

namespace doppel {

std::string declare_required_text(ControllerContext& context, const std::string& name,
                                  const std::string& description, const std::string& example) {
  auto text =
      declare<std::string>(context.node->parameters(), context.overrides, name, "", {description, true, {}});
  if (text.empty()) {
    throw InputError("control.empty_parameter", place_of(context, name),
                     fmt::format("controller '{}' has no '{}' ({})", context.name, name, description),
                     fmt::format("write {}: {} below its ros__parameters", name, example));
  }
  return text;
}

std::array<double, 9> declare_covariance(ControllerContext& context, const std::string& name) {
  const auto written = declare<std::vector<double>>(
      context.node->parameters(), context.overrides, name, std::vector<double>(9, 0.0),
      {"row-major about x, y, z", true, [](const ParameterValue& value) {
         const auto count = std::get<std::vector<double>>(value).size();
         return count == 9 ? Status{} : Status::refused(fmt::format("it must be 9 numbers, not {}", count));
       }});
  std::array<double, 9> out{};
  std::ranges::copy(written, out.begin());
  return out;
}

}  // namespace doppel
