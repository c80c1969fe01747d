#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <regex>
#include <set>

#include "doppel/base/yaml/yaml_fields.h"
#include "doppel/ros/messages/distro.h"
#include "doppel/ros/record/bag_outputs.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

// The keys that are read, and those that mean nothing where the messages are there already.
const std::vector<std::string> kKeys{
    "uri", "storage_id", "max_bagfile_size", "max_bagfile_duration", "storage_preset_profile",
    "storage_config_uri", "start_time_ns", "end_time_ns", "custom_data", "all", "all_topics", "all_services",
    "all_actions", "topics", "topic_types", "services", "actions", "regex", "exclude", "exclude_regex",
    "exclude_topics", "exclude_topic_types", "exclude_services", "exclude_actions", "include_hidden_topics",
    "rmw_serialization_format", "compression_mode", "compression_format", "topic_qos_profile_overrides",
    "snapshot_mode",
    // without an effect
    "max_cache_size", "compression_queue_size", "compression_threads", "compression_threads_priority",
    "is_discovery_disabled", "topic_polling_interval", "include_unpublished_topics", "ignore_leaf_topics",
    "node_prefix", "start_paused", "use_sim_time", "disable_keyboard_controls"};

constexpr const char* kOutputKeyRule = "bag_outputs.invalid";
constexpr const char* kOutputNoteRule = "bag_outputs.other_meaning";

class OutputReader {
 public:
  OutputReader(YamlFields& fields, Diagnostics& notes) : fields_(fields), notes_(notes) {}

  OutputBag read(const PlacedYaml& value) {
    OutputBag out;
    out.where = value.where;
    out.bag.distro = to_string(ros_distro());
    if (!fields_.fields(value, "an output", kKeys)) return out;
    value_ = &value;
    read_storage(out);
    read_compression(out.bag.file);
    read_part(out);
    read_topics(out);
    note_unused();
    return out;
  }

 private:
  // A null is a key that is not there.
  const PlacedYaml* find(const char* key) const {
    const PlacedYaml& found = (*value_)[key];
    return found && !found.is_null() ? &found : nullptr;
  }
  [[nodiscard]] bool flag(const char* key) {
    const PlacedYaml* const found = find(key);
    return found != nullptr && fields_.flag(*found, key);
  }
  // Empty texts are allowed, and mean the default.
  std::string text(const char* key) {
    const PlacedYaml* const found = find(key);
    if (found == nullptr || (found->is_scalar() && found->text.empty())) return "";
    return fields_.text(*found, key);
  }
  // -1, where it is allowed: the default.
  std::int64_t whole(const char* key, std::int64_t lowest) {
    const PlacedYaml* const found = find(key);
    if (found == nullptr) return lowest;
    std::int64_t out = 0;
    const char* const end = found->text.data() + found->text.size();
    const auto [stop, error] = std::from_chars(found->text.data(), end, out);
    if (found->is_scalar() && error == std::errc() && stop == end && out >= lowest) return out;
    fields_.error(*found, fmt::format("{} must be a whole number from {} on{}", key, lowest,
                                      found->is_scalar() ? ", not '" + found->text + "'" : ""));
    return lowest;
  }
  std::vector<std::string> names(const char* key, OutputBag& out) {
    const PlacedYaml* const found = find(key);
    if (found == nullptr) return {};
    std::vector<std::string> texts = fields_.texts(*found, key);
    for (std::size_t i = 0; i < texts.size() && found->is_list(); ++i) {
      // rosbag2 has the topics of a service's events here.
      if (const std::string_view service = service_of_event_topic(texts[i]); !service.empty())
        texts[i] = std::string(service);
      out.places.emplace(texts[i], found->items[i].where);
    }
    return texts;
  }
  std::string expression(const char* key) {
    std::string out = text(key);
    try {
      const std::regex compiled(out);
    } catch (const std::regex_error& error) {
      fields_.error(*find(key), fmt::format("{} is not a regular expression: {}", key, error.what()),
                    "escape ( ) [ ] . * + ? with a backslash where they are meant as characters");
      out.clear();
    }
    return out;
  }
  // A text that must be one of few; the first one is the default.
  std::string choice(const char* key, const std::vector<std::string>& choices) {
    if (text(key).empty()) return choices.front();
    PlacedYaml value = *find(key);
    std::ranges::transform(value.text, value.text.begin(), [](unsigned char c) { return std::tolower(c); });
    return choices[fields_.choice(value, key, choices)];
  }

  void read_storage(OutputBag& out) {
    const PlacedYaml& uri = (*value_)["uri"];
    if (!uri) {
      fields_.error(*value_, "an output needs a uri, the folder of the bag");
    } else {
      fs::path folder = fs::path(fields_.text(uri, "uri")).lexically_normal();
      if (!folder.has_filename()) folder = folder.parent_path();  // "bags/run/"
      out.bag.folder = folder;
    }
    if (const std::string storage = text("storage_id"); storage != "" && storage != "mcap") {
      fields_.error(*find("storage_id"),
                    fmt::format("storage_id is '{}', and doppel writes MCAP files", storage),
                    "make it mcap, or omit it");
    }
    if (const std::string format = text("rmw_serialization_format"); format != "" && format != "cdr") {
      fields_.error(*find("rmw_serialization_format"),
                    fmt::format("messages cannot be converted to '{}'", format),
                    "omit it: they stay as they are");
    }
    out.bag.max_file_size = static_cast<std::uint64_t>(whole("max_bagfile_size", 0));
    constexpr std::int64_t kMaxSeconds = 1'000'000'000;
    const std::int64_t seconds = whole("max_bagfile_duration", 0);
    if (seconds > kMaxSeconds)
      fields_.error(*find("max_bagfile_duration"), "max_bagfile_duration is in seconds");
    out.bag.max_file_time = std::chrono::seconds(std::min(seconds, kMaxSeconds));
    if (const PlacedYaml* const custom = find("custom_data"); custom != nullptr) {
      if (!custom->is_map()) fields_.error(*custom, "custom_data must be a map of texts");
      for (std::size_t i = 0; i < custom->keys.size(); ++i)
        out.bag.custom[custom->keys[i].text] = fields_.text(custom->items[i], "a value of custom_data");
    }
  }

  void read_compression(McapWriterOptions& out) {
    out.compression.clear();
    const std::string preset =
        choice("storage_preset_profile", {"none", "fastwrite", "zstd_fast", "zstd_small", "resilient"});
    if (preset.starts_with("zstd")) out.compression = "zstd";
    constexpr int kSmall = 19;  // the level of zstd_small
    if (preset == "zstd_small") out.level = kSmall;
    const std::string mode = choice("compression_mode", {"none", "file", "message"});
    const std::string format = choice("compression_format", {"none", "zstd", "lz4"});
    if (mode == "none" && format != "none" && find("compression_mode") != nullptr &&
        !text("compression_mode").empty())
      fields_.error(*find("compression_mode"), "there is a compression_format without a mode",
                    "make the mode file, or remove the format");
    if (mode != "none" || format != "none") out.compression = format == "lz4" ? "lz4" : "zstd";
    if (mode == "file" || mode == "message") {
      notes_.note(
          kOutputKeyRule, find("compression_mode")->where,
          fmt::format("compression_mode {}: the chunks within the file are compressed, and its index is kept",
                      mode));
    }
  }

  void read_part(OutputBag& out) {
    const std::int64_t start = whole("start_time_ns", -1), end = whole("end_time_ns", -1);
    if (start >= 0) out.start = static_cast<std::uint64_t>(start);
    if (end >= 0) out.end = static_cast<std::uint64_t>(end);
    if (out.end < out.start) fields_.error(*find("end_time_ns"), "end_time_ns is before start_time_ns");
  }

  void read_topics(OutputBag& out) {
    TopicSelection& topics = out.topics;
    const bool all = flag("all");
    topics.all_topics = flag("all_topics") || all;
    topics.all_services = flag("all_services") || all;
    topics.all_actions = flag("all_actions") || all;
    topics.topics = names("topics", out);
    topics.types = names("topic_types", out);
    topics.services = names("services", out);
    topics.actions = names("actions", out);
    topics.regex = expression("regex");
    topics.exclude_topics = names("exclude_topics", out);
    topics.exclude_types = names("exclude_topic_types", out);
    topics.exclude_services = names("exclude_services", out);
    topics.exclude_actions = names("exclude_actions", out);
    topics.exclude_regex = expression("exclude_regex");
    if (topics.exclude_regex.empty()) topics.exclude_regex = expression("exclude");
    topics.hidden = flag("include_hidden_topics");
    const bool any = topics.all_topics || topics.all_services || topics.all_actions ||
                     !topics.topics.empty() || !topics.types.empty() || !topics.services.empty() ||
                     !topics.actions.empty() || !topics.regex.empty();
    if (!any)
      fields_.error(*value_, "the output selects no topics",
                    "add all_topics: true, or topics: [/joint_states, ...]");
  }

  void note_unused() {
    const auto note = [this](const char* key, const char* why) {
      notes_.note(kOutputNoteRule, find(key)->where, fmt::format("{} has no effect: {}", key, why));
    };
    if (!text("storage_config_uri").empty())
      note("storage_config_uri", "compression_format and max_bagfile_size are what can be chosen");
    if (const PlacedYaml* const qos = find("topic_qos_profile_overrides");
        qos != nullptr && !qos->items.empty())
      note("topic_qos_profile_overrides", "topics keep their recorded qualities");
    if (flag("snapshot_mode")) note("snapshot_mode", "a copy has all selected messages");
  }

  YamlFields& fields_;
  Diagnostics& notes_;
  const PlacedYaml* value_ = nullptr;
};

}  // namespace

std::vector<OutputBag> read_output_bags(const fs::path& file, Diagnostics& notes) {
  const YamlRules rules{"bag_outputs.syntax", "bag_outputs.unreadable", "bag_outputs.too_large",
                        kOutputKeyRule, "bag_outputs.unknown_key"};
  const PlacedYaml root = load_yaml(file, rules, "file of output bags");
  YamlFields fields(rules);
  std::vector<OutputBag> out;
  if (fields.fields(root, "the file", {"output_bags"})) {
    const PlacedYaml& list = root["output_bags"];
    if (!list.is_list() || list.items.empty())
      fields.error(list ? list : root, "output_bags must be a list of bags",
                   "output_bags: [{uri: NAME, all_topics: true}]");
    for (const PlacedYaml& item : list.items) out.push_back(OutputReader(fields, notes).read(item));
  }
  std::set<fs::path> folders;
  for (const OutputBag& one : out) {
    if (!one.bag.folder.empty() && !folders.insert(fs::absolute(one.bag.folder).lexically_normal()).second)
      fields.errors().error(kOutputKeyRule, one.where,
                            fmt::format("the uri '{}' is given twice", one.bag.folder.string()));
  }
  fields.errors().throw_if_errors();
  return out;
}

}  // namespace doppel
