#include "doppel/ros/record/qos_overrides.h"

#include "doppel/base/yaml/yaml_fields.h"

namespace doppel {
namespace {

constexpr double kMaxDepth = 1e6;

std::chrono::nanoseconds time_in(YamlFields& fields, const PlacedYaml& value, const std::string& what) {
  if (!fields.fields(value, what, {"sec", "nsec"})) return {};
  const auto part = [&](const char* key) {
    return value[key] ? fields.number(value[key], what + "." + key) : 0.0;
  };
  const double seconds = part("sec") + part("nsec") * 1e-9;
  constexpr double kInfinite = 9e9;  // of ROS 2's middleware
  return seconds <= 0 || seconds >= kInfinite
             ? std::chrono::nanoseconds{}
             : std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
}

void read_profile(YamlFields& fields, const PlacedYaml& value, Qos& out) {
  const bool is_map =
      fields.fields(value, "the profile",
                    {"history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness",
                     "liveliness_lease_duration", "avoid_ros_namespace_conventions"});
  if (!is_map) return;
  const auto choice = [&](const char* key, const std::vector<std::string>& choices) {
    return value[key] ? fields.choice(value[key], key, choices) : std::size_t{0};
  };
  out.keep_all = choice("history", {"keep_last", "keep_all", "system_default"}) == 1;
  out.best_effort = choice("reliability", {"reliable", "best_effort", "system_default"}) == 1;
  out.latched = choice("durability", {"volatile", "transient_local", "system_default"}) == 1;
  if (const PlacedYaml& depth = value["depth"]) {
    const double number = fields.number(depth, "depth");
    if (number < 0 || number > kMaxDepth || number != static_cast<double>(static_cast<int>(number)))
      fields.error(depth, "depth must be a whole number from 0 to 1000000");
    else
      out.depth = static_cast<std::size_t>(number);
  }
  if (const PlacedYaml& lifespan = value["lifespan"]) out.lifespan = time_in(fields, lifespan, "lifespan");
  for (const char* key : {"deadline", "liveliness_lease_duration"}) {
    if (value[key] && time_in(fields, value[key], key) != std::chrono::nanoseconds{})
      fields.error(value[key], std::string(key) + " is not supported",
                   "remove it, or make it 0 for unlimited");
  }
  static_cast<void>(choice("liveliness", {"system_default", "automatic"}));
}

}  // namespace

std::map<std::string, Qos> read_qos_overrides(const std::filesystem::path& file) {
  const YamlRules rules{"qos.syntax", "qos.unreadable", "qos.too_large", "qos.invalid", "qos.unknown_key"};
  const PlacedYaml root = load_yaml(file, rules, "file of qualities");
  YamlFields fields(rules);
  std::map<std::string, Qos> out;
  if (!root.is_map()) fields.error(root, "the file must be a map from topics to their qualities");
  for (std::size_t i = 0; i < root.keys.size(); ++i)
    read_profile(fields, root.items[i], out[root.keys[i].text]);
  fields.errors().throw_if_errors();
  return out;
}

}  // namespace doppel
