#include "doppel/ros/record/bag_metadata.h"

#include <fmt/format.h>

#include <sstream>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/yaml/placed_yaml.h"
#include "doppel/base/yaml/yaml_text.h"

namespace doppel {
namespace {

// rmw writes an unlimited time as the largest number of nanoseconds.
constexpr const char* kUnlimited = "sec: 9223372036\n    nsec: 854775807";

std::string time_lines(const char* name, const std::string& time) {
  return fmt::format("  {}:\n    {}\n", name, time);
}

std::string qos_lines(const Qos& qos) {
  const Duration whole = std::chrono::floor<std::chrono::seconds>(qos.lifespan);
  const std::string lifespan = qos.lifespan == Duration{}
                                   ? kUnlimited
                                   : fmt::format("sec: {}\n    nsec: {}", whole / std::chrono::seconds(1),
                                                 (qos.lifespan - whole).count());
  return fmt::format("- history: {}\n  depth: {}\n  reliability: {}\n  durability: {}\n",
                     qos.keep_all ? "keep_all" : "keep_last", qos.depth,
                     qos.best_effort ? "best_effort" : "reliable",
                     qos.transient_local() ? "transient_local" : "volatile") +
         time_lines("deadline", kUnlimited) + time_lines("lifespan", lifespan) + "  liveliness: automatic\n" +
         time_lines("liveliness_lease_duration", kUnlimited) + "  avoid_ros_namespace_conventions: false\n";
}

// Each line behind `indent`.
std::string indented(const std::string& text, std::string_view indent) {
  std::string out, line;
  for (std::istringstream lines(text); std::getline(lines, line);) out += fmt::format("{}{}\n", indent, line);
  return out;
}

std::string topic_text(const BagTopicCount& topic) {
  const std::string qos = topic.qos.empty() ? " []\n" : "\n" + indented(topic.qos, "          ");
  return fmt::format(
      "    - topic_metadata:\n"
      "        name: {}\n"
      "        type: {}\n"
      "        serialization_format: {}\n"
      "        offered_qos_profiles:{}"
      "        type_description_hash: {}\n"
      "      message_count: {}\n",
      yaml_text(topic.name), yaml_text(topic.type), topic.encoding, qos,
      topic.type_hash.empty() ? "\"\"" : topic.type_hash, topic.messages);
}

std::string file_text(const BagFileCount& file) {
  return fmt::format(
      "    - path: {}\n"
      "      starting_time:\n"
      "        nanoseconds_since_epoch: {}\n"
      "      duration:\n"
      "        nanoseconds: {}\n"
      "      message_count: {}\n",
      yaml_text(file.path), file.start, file.duration, file.messages);
}

// "key:" with its items, or an empty list.
std::string list_text(const char* key, const std::string& items) {
  return fmt::format("  {}:{}\n{}", key, items.empty() ? " []" : "", items);
}

}  // namespace

std::string bag_metadata_text(const BagMetadata& metadata) {
  std::string topics, paths, files, custom;
  for (const BagTopicCount& topic : metadata.topics) {
    if (topic.messages > 0) topics += topic_text(topic);
  }
  for (const BagFileCount& file : metadata.files) {
    paths += fmt::format("    - {}\n", yaml_text(file.path));
    files += file_text(file);
  }
  for (const auto& [key, value] : metadata.custom)
    custom += fmt::format("    {}: {}\n", yaml_text(key), yaml_text(value));
  return fmt::format(
             "rosbag2_bagfile_information:\n"
             "  version: 9\n"
             "  storage_identifier: mcap\n"
             "  duration:\n"
             "    nanoseconds: {}\n"
             "  starting_time:\n"
             "    nanoseconds_since_epoch: {}\n"
             "  message_count: {}\n",
             metadata.duration, metadata.start, metadata.messages) +
         list_text("topics_with_message_count", topics) +
         "  compression_format: \"\"\n  compression_mode: \"\"\n" + list_text("relative_file_paths", paths) +
         list_text("files", files) + fmt::format("  custom_data:{}\n{}", custom.empty() ? " ~" : "", custom) +
         fmt::format("  ros_distro: {}\n", metadata.distro);
}

std::vector<std::string> files_of_bag_metadata(const std::filesystem::path& file) {
  const YamlRules rules{"bag.metadata", "file.unreadable", "bag.metadata", "bag.metadata", "bag.metadata"};
  const PlacedYaml whole = load_yaml(file, rules, "metadata of a bag");
  const PlacedYaml& bag = whole["rosbag2_bagfile_information"];
  const PlacedYaml& storage = bag["storage_identifier"];
  if (storage && storage.text != "mcap") {
    throw InputError("bag.metadata", storage.where,
                     fmt::format("the bag's storage is {}, and only MCAP is read", storage.text),
                     "convert it with: ros2 bag convert (to storage_id mcap)");
  }
  const PlacedYaml& mode = bag["compression_mode"];
  if (mode && !mode.text.empty()) {
    throw InputError(
        "bag.metadata", mode.where,
        fmt::format("each {} of the bag is compressed by rosbag2, around the MCAP file", mode.text),
        "decompress it with: ros2 bag convert (without compression_mode)");
  }
  const PlacedYaml& paths = bag["relative_file_paths"];
  if (!paths.is_list()) {
    throw InputError("bag.metadata", whole.where, "the metadata of the bag have no list relative_file_paths",
                     "write them again with: doppel bag reindex FOLDER");
  }
  std::vector<std::string> out;
  for (const PlacedYaml& path : paths.items) out.push_back(path.text);
  return out;
}

std::string offered_qos_text(const std::vector<Qos>& offered) {
  std::string out;
  for (const Qos& qos : offered) out += qos_lines(qos);
  return out;
}

}  // namespace doppel
