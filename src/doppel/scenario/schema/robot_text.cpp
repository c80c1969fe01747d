#include "doppel/scenario/schema/robot_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/text.h"
#include "doppel/ros/bus/name_rules.h"

namespace doppel {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw InputError("cli.robot", {}, fmt::format("--robot {}: {}", text, why),
                   "write TARGET[:NAMESPACE][@x,y,z[,roll,pitch,yaw]], for example omarm_one:left@0,0.4,0");
}

}  // namespace

Pose parse_place(const std::string& text, const std::string& option) {
  const auto refuse_place = [&](const std::string& why) {
    return InputError("cli.place", {}, fmt::format("{} is '{}': {}", option, text, why),
                      "write x,y,z or x,y,z,roll,pitch,yaw, in m and rad");
  };
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const auto value = parse_number(text.substr(begin, end - begin));
    if (!value)
      throw refuse_place(fmt::format("'{}' is not a finite number", text.substr(begin, end - begin)));
    numbers.push_back(*value);
    begin = end + 1;
  }
  if (numbers.size() != 3 && numbers.size() != 6)
    throw refuse_place(fmt::format("a pose has 3 or 6 numbers, not {}", numbers.size()));
  numbers.resize(6, 0.0);
  return make_pose({numbers[0], numbers[1], numbers[2]}, {numbers[3], numbers[4], numbers[5]});
}

WorldRobot parse_robot(const std::string& text) {
  WorldRobot out;
  std::error_code none;
  if (std::filesystem::exists(text, none)) {
    out.target = text;
    return out;
  }
  std::string rest = text;
  if (const std::size_t at = rest.rfind('@'); at != std::string::npos) {
    out.X_WR = parse_place(rest.substr(at + 1), "the pose of --robot");
    rest.erase(at);
  }
  if (const std::size_t colon = rest.rfind(':'); colon != std::string::npos && colon > 0) {
    out.name_space = rest.substr(colon + 1);
    if (out.name_space.starts_with('/')) out.name_space.erase(0, 1);
    if (out.name_space.empty()) refuse(text, "the namespace after the colon is missing");
    if (const Status fine = check_namespace("/" + out.name_space); !fine) refuse(text, fine.why());
    rest.erase(colon);
  }
  if (rest.empty()) refuse(text, "the target is missing");
  out.target = rest;
  return out;
}

}  // namespace doppel
