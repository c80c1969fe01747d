#include "doppel/scenario/launch/detail/launch_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

namespace doppel {
namespace {

using Json = nlohmann::json;

struct KindName {
  const char* name;
  LaunchKind kind;
};

constexpr std::array kKinds = std::to_array<KindName>({
    {"node", LaunchKind::node},
    {"process", LaunchKind::process},
    {"include", LaunchKind::include},
    {"timer", LaunchKind::timer},
    {"event", LaunchKind::event},
    {"skipped", LaunchKind::skipped},
    {"unknown", LaunchKind::unknown},
    {"parameter", LaunchKind::parameter},
    {"environment", LaunchKind::environment},
    {"components", LaunchKind::components},
    {"gz_server", LaunchKind::gz_server},
    {"gz_spawn_model", LaunchKind::gz_spawn_model},
    {"log", LaunchKind::log},
    {"emit", LaunchKind::emit},
    {"shutdown", LaunchKind::shutdown},
});

LaunchKind kind_of(const std::string& name) {
  const auto* const found =
      std::find_if(kKinds.begin(), kKinds.end(), [&](const KindName& one) { return name == one.name; });
  return found == kKinds.end() ? LaunchKind::unknown : found->kind;
}

std::string text_of(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

bool is_description(const Json& value) {
  return value.is_object() && value.contains("text") && value.contains("source");
}

// Also a text that the launch file has made: no other parameter holds such XML.
bool is_robot(const std::string& name, const Json& value) {
  if (!name.ends_with("description")) return false;
  if (is_description(value)) return true;
  if (!value.is_string()) return false;
  const std::string& text = value.get_ref<const std::string&>();
  return text.find("<robot") != std::string::npos || text.find("<sdf") != std::string::npos;
}

LaunchedRobotText robot_text(const Json& value) {
  LaunchedRobotText out;
  if (value.is_string()) {
    out.text = value.get<std::string>();
    return out;
  }
  out.source = value.value("source", "");
  out.text = value.value("text", "");
  for (const Json& pair : value.at("arguments"))
    out.arguments.emplace_back(pair.at(0).get<std::string>(), pair.at(1).get<std::string>());
  return out;
}

NamedTexts pairs_of(const Json& value) {
  NamedTexts out;
  if (value.is_object()) {
    for (const auto& [name, text] : value.items()) out.emplace_back(name, text_of(text));
  } else {
    for (const Json& pair : value) out.emplace_back(text_of(pair.at(0)), text_of(pair.at(1)));
  }
  return out;
}

void add_parameters(const Json& sets, LaunchRecord& out) {
  for (const Json& set : sets) {
    LaunchParameters& parameters = out.parameters.emplace_back();
    if (set.contains("path")) parameters.file = set.at("path").get<std::string>();
    if (!set.contains("values")) continue;
    for (const auto& [name, value] : set.at("values").items()) {
      if (is_robot(name, value)) {
        out.descriptions.emplace_back(name, robot_text(value));
      } else {
        parameters.values.emplace_back(name, value.dump());
      }
    }
  }
}

// Records in one another: the reader's includes and groups end far below.
constexpr int kMaxRecordDepth = 400;

LaunchRecord record_of(const Json& value, int depth);

void add_records(const Json& list, int depth, std::vector<LaunchRecord>& out) {
  if (depth > kMaxRecordDepth)
    throw InputError("launch.unreadable", {}, "the records of the launch file are nested too deeply");
  for (const Json& one : list) out.push_back(record_of(one, depth));
}

void add_components(const Json& list, int depth, LaunchRecord& out) {
  for (const Json& one : list) {
    LaunchRecord& component = out.children.emplace_back(record_of(one, depth));
    component.kind = LaunchKind::node;
    component.executable = one.value("plugin", "");
  }
}

LaunchRecord record_of(const Json& value, int depth) {
  LaunchRecord out;
  out.kind = kind_of(value.value("kind", ""));
  out.source = launch_place(value);
  out.id = value.value("id", 0);
  out.package = value.value("package", "");
  out.executable = value.value("executable", "");
  out.name = value.value("name", "");
  out.name_space = value.value("namespace", "");
  for (const char* key : {"text", "why", "reason"}) {
    if (value.contains(key)) out.text = text_of(value.at(key));
  }
  out.path = value.value("path", "");
  for (const char* key : {"words", "ros_arguments"}) {
    if (value.contains(key)) {
      for (const Json& word : value.at(key)) out.words.push_back(text_of(word));
    }
  }
  if (value.contains("parameters")) add_parameters(value.at("parameters"), out);
  if (value.contains("remappings")) out.remappings = pairs_of(value.at("remappings"));
  if (value.contains("environment")) out.environment = pairs_of(value.at("environment"));
  if (value.contains("arguments")) out.arguments = pairs_of(value.at("arguments"));
  if (value.contains("values")) out.arguments = pairs_of(value.at("values"));
  if (value.contains("value")) {
    const Json& content = value.at("value");
    out.text = text_of(content);
    if (is_robot(out.name, content)) {
      out.descriptions.emplace_back(out.name, robot_text(content));
      out.text.clear();
    }
  }
  if (value.contains("after")) out.after = value.at("after").get<std::vector<int>>();
  out.period = value.value("period", 0.0);
  out.missing = value.value("missing", false);
  out.required = value.value("required", false);
  out.ros1 = value.value("ros1", false);
  out.folder = value.value("cwd", "");
  if (value.contains("children")) add_records(value.at("children"), depth + 1, out.children);
  if (value.contains("components")) add_components(value.at("components"), depth + 1, out);
  return out;
}

LaunchArgument argument_of(const Json& value) {
  LaunchArgument out;
  out.name = value.value("name", "");
  out.default_value = value.value("default", "");
  out.description = value.value("description", "");
  out.value = value.value("value", "");
  out.choices = value.at("choices").get<std::vector<std::string>>();
  out.is_given = value.value("given", false);
  out.source = launch_place(value);
  return out;
}

LaunchExpansion expansion_of(const Json& value) {
  LaunchExpansion out;
  out.file = value.at("path").get<std::string>();
  for (const Json& pair : value.at("arguments"))
    out.arguments.emplace_back(pair.at(0).get<std::string>(), pair.at(1).get<std::string>());
  out.by_command = value.value("call", "") == "Command";
  out.source = launch_place(value);
  return out;
}

}  // namespace

SourceLocation launch_place(const Json& record) {
  const std::string file = record.value("file", "");
  return file.empty() ? SourceLocation{} : make_location(file, record.value("line", 0));
}

Json bounded_json(const std::string& line) {
  static constexpr int kMaxLevels = 1000;  // above that of records in one another, each with its list
  static constexpr std::size_t kMaxValues = 1'000'000;
  std::size_t count = 0;
  const auto check = [&count](int depth, Json::parse_event_t, const Json&) {
    if (depth <= kMaxLevels && ++count <= kMaxValues) return true;
    throw InputError(
        "launch.unreadable", {},
        fmt::format("the records of the launch file are too many, or nested too deeply: at most {} values "
                    "and {} levels are read",
                    kMaxValues, kMaxLevels));
  };
  return Json::parse(line, check, false);
}

LaunchDescription launch_from_json(const Json& result) {
  LaunchDescription out;
  for (const Json& file : result.at("files")) out.files.emplace_back(file.get<std::string>());
  for (const Json& argument : result.at("arguments")) out.arguments.push_back(argument_of(argument));
  add_records(result.at("actions"), 0, out.records);
  for (const Json& one : result.at("packages"))
    out.packages.push_back({one.at("package").get<std::string>(), launch_place(one)});
  for (const Json& one : result.at("expansions")) out.expansions.push_back(expansion_of(one));
  for (const auto& [made, source] : result.at("made").items())
    out.made_files.emplace_back(made, source.get<std::string>());
  for (const Json& warning : result.at("warnings")) {
    out.diagnostics.warning(warning.value("rule", ""), launch_place(warning), warning.value("text", ""),
                            warning.value("fix", ""));
  }
  return out;
}

std::optional<std::string> LaunchRecord::parameter(std::string_view parameter_name) const {
  for (auto set = parameters.rbegin(); set != parameters.rend(); ++set) {
    for (const auto& [key, value] : set->values) {
      if (key == parameter_name) return text_of(Json::parse(value));
    }
  }
  return std::nullopt;
}

std::string bare_namespace(const std::string& name_space) {
  const std::size_t begin = name_space.find_first_not_of('/');
  if (begin == std::string::npos) return "";
  return name_space.substr(begin, name_space.find_last_not_of('/') - begin + 1);
}

}  // namespace doppel
