#include "doppel/review/identification/payload.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/math/mass_properties.h"
#include "doppel/base/math/quantity.h"
#include "doppel/robot/semantics/planning_groups.h"
#include "doppel/ros/record/bag_metadata.h"

namespace doppel {
namespace {

constexpr double kRecordGap = 3.0;  // s, between joined records
constexpr std::size_t kMaxMetadataBytes = std::size_t{1} << 24U;
constexpr const char *kPayloadKey = "doppel_payload", *kPayloadLinkKey = "doppel_payload_link";
constexpr double kRecordSettling = 0.5;  // s, of a later record: how its rest was reached is not recorded

[[noreturn]] void refuse_payload(const std::string& text) {
  throw InputError("cli.use", {}, fmt::format("'{}' is not a payload", text),
                   "write a mass, or mass@x,y,z with its place in the link's frame in m: 200g@0,0,0.06");
}

}  // namespace

Payload read_payload(const std::string& text, const std::string& link) {
  const std::size_t mark = text.find('@');
  const auto mass = parse_quantity(text.substr(0, mark), QuantityKind::mass);
  if (!mass || !(*mass > 0) || !std::isfinite(*mass)) refuse_payload(text);
  Payload out{*mass, link, Eigen::Vector3d::Zero()};
  if (mark == std::string::npos) return out;
  std::string rest = text.substr(mark + 1) + ",";
  for (Eigen::Index i = 0; i < 3; ++i) {
    const std::size_t comma = rest.find(',');
    const auto number = comma == std::string::npos
                            ? std::nullopt
                            : parse_quantity(rest.substr(0, comma), QuantityKind::length);
    if (!number) refuse_payload(text);
    out.p_LoC_L[i] = *number;
    rest.erase(0, comma + 1);
  }
  if (!rest.empty()) refuse_payload(text);
  return out;
}

std::string payload_text(const Payload& payload) {
  const Eigen::Vector3d& p = payload.p_LoC_L;
  return fmt::format("{:.9g}@{:.9g},{:.9g},{:.9g}", payload.mass, p.x(), p.y(), p.z());
}

std::optional<Payload> recorded_payload(const std::string& bag) {
  const std::filesystem::path file = std::filesystem::path(bag) / kBagMetadataFile;
  if (!std::filesystem::is_regular_file(file)) return {};
  try {
    const YAML::Node root = YAML::Load(read_file(file.string(), kMaxMetadataBytes));
    const YAML::Node data = root["rosbag2_bagfile_information"]["custom_data"];
    if (!data || !data.IsMap() || !data[kPayloadKey]) return {};
    const YAML::Node link = data[kPayloadLinkKey];
    return read_payload(data[kPayloadKey].as<std::string>(), link ? link.as<std::string>() : "");
  } catch (const YAML::Exception& problem) {
    const auto path = std::make_shared<const std::string>(file.string());
    throw InputError("bag.metadata", {path, problem.mark.line + 1, problem.mark.column + 1, nullptr},
                     problem.msg, "doppel bag reindex writes it anew");
  }
}

std::map<std::string, std::string> payload_data(const Payload& payload) {
  return {{kPayloadKey, payload_text(payload)}, {kPayloadLinkKey, payload.link}};
}

std::string payload_link(const Model& model, const Payload& payload) {
  if (!payload.link.empty()) {
    if (model.find_link(payload.link) >= 0) return payload.link;
    throw InputError("cli.use", {},
                     fmt::format("the robot has no link '{}'{}", payload.link,
                                 did_you_mean(payload.link, model.link_names())),
                     "doppel tree lists links and joints");
  }
  std::string out;
  int arms = 0;
  for (const PlanningGroup& group : find_planning_groups(model, {})) {
    if (group.gripper || group.tip_link < 0) continue;
    out = model.links[static_cast<std::size_t>(group.tip_link)].name;
    ++arms;
  }
  if (arms == 1) return out;
  throw InputError(
      "cli.use", {},
      fmt::format("the robot has {} arms, so that the link with the weight is to be named", arms),
      "--payload-link LINK; doppel tree lists links and joints");
}

Model loaded_model(const Model& model, const Payload& payload) {
  Model out = model;
  ModelLink& link = out.links[static_cast<std::size_t>(model.find_link(payload_link(model, payload)))];
  const MassProperties weight{payload.mass, payload.p_LoC_L, Eigen::Matrix3d::Zero()};
  link.inertia = link.inertia ? combined(*link.inertia, weight) : weight;
  out.total_mass += payload.mass;
  return out;
}

JointRecord joined_records(const std::vector<JointRecord>& records) {
  JointRecord out = records.front();
  for (std::size_t i = 1; i < records.size(); ++i) {
    const JointRecord& next = records[i];
    const double begin = std::max(out.time.back(), out.command_time.back()) + kRecordGap;
    const double zero = std::min(next.time.front(), next.command_time.front());
    for (std::size_t k = 0; k < next.command.size(); ++k) {
      out.command_time.push_back(begin + next.command_time[k] - zero);
      out.command.push_back(next.command[k]);
    }
    for (std::size_t k = 0; k < next.time.size(); ++k) {
      if (next.time[k] - next.time.front() < kRecordSettling) continue;
      out.time.push_back(begin + next.time[k] - zero);
      out.position.push_back(next.position[k]);
      out.load.push_back(next.load[k]);
      out.inertia.push_back(next.inertia[k]);
    }
    for (const ReleasedSpan& one : next.released)
      out.released.push_back(
          {begin + one.begin - zero, begin + one.end - zero, one.caught, begin + one.follows - zero});
    out.yielding = std::max(out.yielding, next.yielding);
  }
  return out;
}

}  // namespace doppel
