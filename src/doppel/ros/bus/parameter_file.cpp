#include "doppel/ros/bus/parameter_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/files_read.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/yaml_fix.h"
#include "doppel/ros/bus/detail/yaml_value.h"
#include "doppel/ros/bus/parameter_file_text.h"

namespace doppel {
namespace {

constexpr const char* kParameters = "ros__parameters";
constexpr int kMaxDepth = 64;               // of nested maps; a YAML alias can contain itself
constexpr std::size_t kMaxValues = 20'000;  // aliases of aliases multiply

std::vector<std::string> tokens_of(std::string_view node) {
  std::vector<std::string> tokens;
  for (std::size_t begin = 0; begin <= node.size();) {
    const std::size_t end = std::min(node.find('/', begin), node.size());
    if (end > begin) tokens.emplace_back(node.substr(begin, end - begin));
    begin = end + 1;
  }
  return tokens;
}

// "*" stands for one token of a node's name, "**" for any number of them.
bool matches(std::span<const std::string> pattern, std::span<const std::string> name) {
  if (pattern.empty()) return name.empty();
  if (pattern[0] == "**") {
    for (std::size_t skip = 0; skip <= name.size(); ++skip) {
      if (matches(pattern.subspan(1), name.subspan(skip))) return true;
    }
    return false;
  }
  if (name.empty() || (pattern[0] != "*" && pattern[0] != name[0])) return false;
  return matches(pattern.subspan(1), name.subspan(1));
}

bool has_wildcard(std::string_view node) {
  return node.find('*') != std::string_view::npos;
}

// Reads a file once and collects its values and all of its errors.
class Reader {
 public:
  struct Found {
    std::string node;
    std::vector<ParameterOverride> values;
  };

  explicit Reader(FileName file) : file_(std::move(file)) {}

  void read_nodes(const YAML::Node& map, const std::string& path, int depth) {
    if (depth > kMaxDepth) return too_deep(map);
    for (const auto& entry : map) {
      const SourceLocation place = place_of(entry.first);
      if (!check_key(entry.first)) continue;
      const std::string& key = entry.first.Scalar();
      if (key == kParameters) {
        read_section(entry.second, path, place);
      } else if (entry.second.IsMap()) {
        const std::string tail = key.starts_with('/') && !path.empty() ? key.substr(1) : key;
        read_nodes(entry.second, path.empty() ? tail : path + (path.ends_with('/') ? "" : "/") + tail,
                   depth + 1);
      } else {
        errors.error("yaml.outside_parameters", place,
                     fmt::format("'{}' is outside {}, where ROS 2 reads no values", key, kParameters),
                     fmt::format("write it as {}: {{{}: {{{}: ...}}}}", path.empty() ? "NODE" : path,
                                 kParameters, key));
      }
    }
  }

  // Parameters without a node; what ROS 2 refuses is left out.
  std::vector<ParameterOverride> read_plain(const YAML::Node& map) {
    sections.push_back({"", {}});
    read_parameters(map, "", 0);
    return std::move(sections.back().values);
  }

  std::vector<Found> sections;
  Diagnostics errors;

 private:
  [[nodiscard]] SourceLocation place_of(const YAML::Node& node) const {
    return yaml_place(file_, node.Mark());
  }

  void too_deep(const YAML::Node& node) {
    errors.error("yaml.too_deep", place_of(node),
                 "maps are nested too deep here, or an alias contains itself");
  }

  // As in rcl_yaml_param_parser, a node may be written twice, and both are read. A parameter may not.
  bool check_key(const YAML::Node& key, std::vector<std::pair<std::string, SourceLocation>>* seen = nullptr) {
    if (!key.IsScalar() || key.Scalar().empty()) {
      errors.error("yaml.bad_key", place_of(key), "a key must be a plain scalar");
      return false;
    }
    if (key.Scalar() == "<<") {
      errors.error("yaml.merge_key", place_of(key), "ROS 2 does not read merge keys ('<<')",
                   "write the values out where they are used");
      return false;
    }
    if (seen == nullptr) return true;
    for (const auto& [name, place] : *seen) {
      if (name == key.Scalar()) {
        duplicate(name, place_of(key), place);
        return false;
      }
    }
    seen->emplace_back(key.Scalar(), place_of(key));
    return true;
  }

  void duplicate(const std::string& name, const SourceLocation& second, const SourceLocation& first) {
    errors.error("yaml.duplicate_key", second,
                 fmt::format("'{}' is given twice; the first one is at {}", name, first.place()),
                 "remove one of them");
  }

  void read_section(const YAML::Node& node, const std::string& path, const SourceLocation& place) {
    if (path.empty()) {
      errors.error("yaml.no_node", place,
                   fmt::format("'{}' is at the top level, without the name of a node", kParameters),
                   "write the node's name above it, or /** for every node");
      return;
    }
    sections.push_back({path, {}});
    if (node.IsNull()) return;  // "ros__parameters:" and nothing below is common, and harmless
    if (!node.IsMap()) {
      errors.error("yaml.not_a_map", place,
                   fmt::format("'{}' must be a map of names and values", kParameters));
      return;
    }
    read_parameters(node, "", 0);
  }

  void read_parameters(const YAML::Node& map, const std::string& prefix, int depth) {
    if (depth > kMaxDepth || ++values_ > kMaxValues) return too_deep(map);
    std::vector<std::pair<std::string, SourceLocation>> seen;
    for (const auto& entry : map) {
      if (!check_key(entry.first, &seen)) continue;
      const std::string name = prefix + entry.first.Scalar();
      const YAML::Node& value = entry.second;
      if (value.IsMap()) {
        read_parameters(value, name + ".", depth + 1);
      } else if (value.IsNull()) {
        errors.error("yaml.no_value", place_of(entry.first), fmt::format("parameter '{}' has no value", name),
                     "write one ('' for an empty string, [] for an empty list), or remove the line");
      } else {
        YamlValue read = value.IsSequence() ? read_list(value, name, file_, errors) : read_scalar(value);
        if (std::holds_alternative<std::monostate>(read.value)) continue;
        add(name, std::move(read), place_of(value));
      }
    }
  }

  void add(const std::string& name, YamlValue read, SourceLocation place) {
    auto& values = sections.back().values;
    for (const ParameterOverride& other : values) {
      if (other.name == name) return duplicate(name, place, other.source);
    }
    ++values_;
    values.push_back({name, std::move(read.value), std::move(place), std::move(read.elements), false});
  }

  FileName file_;
  std::size_t values_ = 0;
};

// Gives the map of a text to `read`; a text that is something else has none.
template <typename Read>
void read_yaml(const std::string& yaml, const FileName& file, const Read& read) {
  try {
    const YAML::Node root = YAML::Load(yaml);
    if (root.IsMap()) read(root);
  } catch (const YAML::Exception& problem) {
    throw InputError("yaml.syntax", yaml_place(file, problem.mark),
                     "this is not well-formed YAML: " + problem.msg, yaml_fix(problem.msg));
  }
}

template <class T>
ParameterValue doubles_from_ints(const T& ints) {
  return std::vector<double>(ints.begin(), ints.end());
}

bool is_list(const ParameterValue& value) {
  return std::holds_alternative<std::vector<bool>>(value) ||
         std::holds_alternative<std::vector<std::int64_t>>(value) ||
         std::holds_alternative<std::vector<double>>(value) ||
         std::holds_alternative<std::vector<std::string>>(value);
}

// The value converted to the type of `wanted`, or monostate if that is not possible.
ParameterValue fitted(const ParameterValue& value, const ParameterValue& wanted) {
  if (std::holds_alternative<std::monostate>(wanted) || value.index() == wanted.index()) return value;
  if (std::holds_alternative<double>(wanted)) {
    if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  }
  if (std::holds_alternative<std::vector<double>>(wanted)) {
    if (const auto* whole = std::get_if<std::vector<std::int64_t>>(&value)) return doubles_from_ints(*whole);
  }
  const auto* texts = std::get_if<std::vector<std::string>>(&value);
  if (texts != nullptr && texts->empty() && is_list(wanted)) {
    if (std::holds_alternative<std::vector<bool>>(wanted)) return std::vector<bool>{};
    if (std::holds_alternative<std::vector<std::int64_t>>(wanted)) return std::vector<std::int64_t>{};
    return std::vector<double>{};
  }
  return {};
}

std::string how_to_fit(const ParameterValue& value, const ParameterValue& wanted) {
  const bool texts =
      std::holds_alternative<std::string>(wanted) || std::holds_alternative<std::vector<std::string>>(wanted);
  if (texts && (std::holds_alternative<bool>(value) || std::holds_alternative<std::vector<bool>>(value))) {
    return "quote names: ROS 2 reads y, n, yes, no, on and off as booleans";
  }
  if (std::holds_alternative<std::int64_t>(wanted) && std::holds_alternative<double>(value)) {
    return "write an integer, without a decimal point";
  }
  if (is_list(wanted) && !is_list(value)) return fmt::format("write it as a list: [{}]", to_string(value));
  if (std::holds_alternative<std::string>(wanted)) return fmt::format("quote it: \"{}\"", to_string(value));
  return "";
}

// Parameters of every node of ROS 2, which need not be used.
bool is_standard_parameter(std::string_view name) {
  return name == "use_sim_time" || name == "start_type_description_service" ||
         name.starts_with("qos_overrides.");
}

}  // namespace

ParameterOverride* ParameterOverrides::find(std::string_view name) {
  const auto found = std::find_if(all_.begin(), all_.end(), [&](const auto& o) { return o.name == name; });
  return found == all_.end() ? nullptr : &*found;
}

std::vector<std::string> ParameterOverrides::children(std::string_view prefix) const {
  std::vector<std::string> out;
  for (const ParameterOverride& o : all_) {
    const std::string_view name = o.name;
    if (!name.starts_with(prefix) || name.size() <= prefix.size() || name[prefix.size()] != '.') continue;
    const std::string_view rest = name.substr(prefix.size() + 1);
    const std::string child(rest.substr(0, rest.find('.')));
    if (std::find(out.begin(), out.end(), child) == out.end()) out.push_back(child);
  }
  return out;
}

ParameterValue declare_parameter(Parameters& parameters, ParameterOverrides* overrides,
                                 const std::string& name, ParameterValue initial, DeclareOptions options) {
  ParameterOverride* written = overrides == nullptr ? nullptr : overrides->find(name);
  ParameterValue value = initial;
  if (written != nullptr) {
    written->used = true;
    value = fitted(written->value, initial);
    if (std::holds_alternative<std::monostate>(value)) {
      throw InputError("parameter.type", written->source,
                       fmt::format("parameter '{}' is {}, but this is {}", name, kind_of(initial),
                                   kind_of(written->value)),
                       how_to_fit(written->value, initial));
    }
    Status inside = options.range ? check_range(*options.range, value) : Status();
    if (inside && options.check) inside = options.check(value);
    if (!inside)
      throw InputError("parameter.value", written->source,
                       fmt::format("parameter '{}': {}", name, inside.why()));
  }
  return parameters.declare(name, std::move(value), std::move(options));
}

void report_unused(const ParameterOverrides& overrides, const std::string& node,
                   const std::vector<std::string>& valid_names, Diagnostics& diagnostics) {
  for (const ParameterOverride& o : overrides.all()) {
    if (o.used || is_standard_parameter(o.name)) continue;
    diagnostics.warning("parameter.unknown", o.source,
                        fmt::format("'{}' has no parameter '{}', so this value has no effect{}", node, o.name,
                                    did_you_mean(o.name, valid_names)));
  }
}

ParameterFile ParameterFile::load(const std::filesystem::path& file) {
  FilesRead::note(file);
  const FileContent content = read_content(file, kMaxParameterFileBytes);
  if (content.was_read()) return parse(content.bytes, file.string());
  throw InputError(
      "yaml.unreadable", make_location(file.string()),
      fmt::format("this parameter file cannot be read: {}",
                  content.is_missing ? "there is no such file" : content.problem),
      content.is_missing
          ? "correct the path; it starts in the working directory"
          : "write the parameters into a file that is readable: it is read again at each reload");
}

ParameterOverrides read_plain_parameters(const std::string& yaml, const std::string& name) {
  std::vector<ParameterOverride> values;
  const auto file = std::make_shared<const std::string>(name);
  Reader reader(file);
  read_yaml(yaml, file, [&](const YAML::Node& map) { values = reader.read_plain(map); });
  return ParameterOverrides(std::move(values));
}

ParameterFile ParameterFile::of(std::vector<Node> nodes, const std::string& yaml, const std::string& name) {
  ParameterFile out;
  out.name_ = name;
  out.text_ = yaml;
  for (Node& node : nodes) out.sections_.push_back({{std::move(node.name), std::move(node.values)}, 0});
  return out;
}

ParameterFile ParameterFile::parse(const std::string& yaml, const std::string& name) {
  const auto file = std::make_shared<const std::string>(name);
  Reader reader(file);
  read_yaml(yaml, file, [&](const YAML::Node& map) { reader.read_nodes(map, "", 0); });
  reader.errors.throw_if_errors();
  if (reader.sections.empty()) {
    throw InputError(
        "yaml.no_parameters", make_location(name),
        fmt::format("there is no '{}' in this file, so it is not a ROS 2 parameter file", kParameters),
        fmt::format("write NODE: {{{}: {{NAME: VALUE}}}}", kParameters));
  }
  std::vector<Node> nodes;
  for (auto& section : reader.sections) nodes.push_back({std::move(section.node), std::move(section.values)});
  return of(std::move(nodes), yaml, name);
}

void ParameterFile::add(ParameterFile later) {
  ++layers_;
  text_ += later.text_;
  for (auto& [section, layer] : later.sections_) sections_.push_back({std::move(section), layers_});
}

void ParameterFile::add(const std::string& node, const std::string& name, ParameterValue value,
                        const std::string& text) {
  ++layers_;
  Section section{node.empty() ? "/**" : node, {}};
  section.values.push_back({name, std::move(value), make_location(text), {}, false});
  sections_.push_back({std::move(section), layers_});
}

ParameterOverrides ParameterFile::overrides_for(std::string_view node, std::string_view given_name) const {
  std::string_view at_home = given_name;
  if (!home_.empty() && at_home.starts_with(home_ + "/")) at_home.remove_prefix(home_.size());
  const auto wanted = tokens_of(node), given = tokens_of(given_name), local = tokens_of(at_home);
  std::vector<ParameterOverride> all;
  const auto take = [&](const Section& section) {
    for (const ParameterOverride& value : section.values) {
      const auto same =
          std::find_if(all.begin(), all.end(), [&](const auto& o) { return o.name == value.name; });
      if (same == all.end()) {
        all.push_back(value);
      } else {
        *same = value;
      }
    }
  };
  for (int layer = 0; layer <= layers_; ++layer) {
    for (const bool wildcards : {true, false}) {
      for (const auto& [section, of_layer] : sections_) {
        if (of_layer != layer || has_wildcard(section.node) != wildcards) continue;
        const auto pattern = tokens_of(section.node);
        const bool meant = matches(pattern, wanted) || (!given.empty() && matches(pattern, given)) ||
                           (!local.empty() && matches(pattern, local));
        if (meant) take(section);
      }
    }
  }
  return ParameterOverrides(std::move(all));
}

std::vector<std::string> ParameterFile::nodes() const {
  std::vector<std::string> out;
  for (const auto& [section, layer] : sections_) {
    if (!has_wildcard(section.node)) out.push_back(section.node);
  }
  return out;
}

void add_ros_parameters(const RosArguments& arguments, ParameterFile& parameters) {
  for (const auto& given : arguments.parameters) {
    if (const auto* file = std::get_if<GivenParameterFile>(&given)) {
      parameters.add(ParameterFile::load(file->path));
    } else {
      const auto& one = std::get<GivenParameter>(given);
      parameters.add(one.node, one.name, one.value, "-p " + one.text);
    }
  }
}

}  // namespace doppel
