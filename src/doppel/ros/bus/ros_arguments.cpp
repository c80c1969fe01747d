#include "doppel/ros/bus/ros_arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "doppel/base/core/names.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/detail/ros_arguments.h"

namespace doppel {
namespace {

const std::map<std::string, Severity, std::less<>> kLevels = {{"debug", Severity::note},
                                                              {"info", Severity::note},
                                                              {"warn", Severity::warning},
                                                              {"error", Severity::error},
                                                              {"fatal", Severity::error}};

const std::vector<std::string> kFlags = {"-r",          "--remap", "-p",       "--param", "--params-file",
                                         "--log-level", "-e",      "--enclave"};
// Of rcl's logging, which is not ROS's here.
const std::vector<std::string> kIdleFlags = {"--enable-rosout-logs",       "--disable-rosout-logs",
                                             "--enable-stdout-logs",       "--disable-stdout-logs",
                                             "--enable-external-lib-logs", "--disable-external-lib-logs"};

bool is_one_of(const std::vector<std::string>& all, const std::string& word) {
  return std::ranges::find(all, word) != all.end();
}

GivenParameter read_parameter(const std::string& text) {
  const auto refuse = [&text](const std::string& why) {
    throw InputError("cli.ros_args", {}, fmt::format("the parameter '{}' {}", text, why),
                     "write -p NAME:=VALUE, or -p NODE:NAME:=VALUE for one node");
  };
  const std::size_t arrow = text.find(":=");
  if (arrow == std::string::npos || arrow == 0) refuse("is not of the form NAME:=VALUE");
  GivenParameter given;
  given.text = text;
  given.name = text.substr(0, arrow);
  if (const std::size_t colon = given.name.find(':'); colon != std::string::npos) {
    given.node = given.name.substr(0, colon);
    given.name = given.name.substr(colon + 1);
    const std::string base = node_base_name(given.node);
    if (const Status fine = check_node_name(base); !fine && base.find('*') == std::string::npos)
      refuse("cannot be used: " + fine.why());
  }
  if (given.name.empty()) refuse("has no name");
  given.value = parse_parameter(text.substr(arrow + 2));
  return given;
}

// "level" or "logger:=level"; loggers are not distinguished here.
Severity read_level(const std::string& text) {
  const std::size_t arrow = text.find(":=");
  if (arrow != std::string::npos) {
    throw InputError(
        "cli.ros_args", {},
        fmt::format("--log-level {} is for one logger, but all nodes of the twin share one log", text),
        fmt::format("write --log-level {}", text.substr(arrow + 2)));
  }
  std::string lower = text;
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto found = kLevels.find(lower);
  if (found != kLevels.end()) return found->second;
  std::vector<std::string> levels;
  for (const auto& [name, severity] : kLevels) levels.push_back(name);
  throw InputError("cli.ros_args", {},
                   fmt::format("there is no log level '{}'{}", text, did_you_mean(lower, levels)));
}

std::string read_enclave(const std::string& text) {
  if (const Status fine = check_namespace(text); !fine)
    throw InputError("cli.ros_args", {},
                     fmt::format("the enclave '{}' cannot be used: {}", text, fine.why()));
  return text;
}

void take_flag(const std::string& flag, const std::string& value, RosArguments& out,
               std::vector<std::string>& rules) {
  if (flag == "-r" || flag == "--remap") {
    out.names.add(value);
    rules.push_back(value);
  } else if (flag == "-p" || flag == "--param") {
    out.parameters.emplace_back(read_parameter(value));
  } else if (flag == "--params-file") {
    out.parameters.emplace_back(GivenParameterFile{value});
  } else if (flag == "-e" || flag == "--enclave") {
    out.enclave = read_enclave(value);
  } else {
    out.log_level = read_level(value);
  }
}

void read_section(std::span<const std::string> words, RosArguments& out, std::vector<std::string>& rules) {
  std::vector<Diagnostic> errors;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    try {
      if (is_one_of(kIdleFlags, word)) continue;
      if (!is_one_of(kFlags, word)) {
        std::vector<std::string> known = kFlags;
        known.insert(known.end(), kIdleFlags.begin(), kIdleFlags.end());
        const bool rule = word.find(":=") != std::string::npos;
        throw InputError("cli.ros_args", {},
                         fmt::format("'{}' is not an argument of --ros-args{}", word,
                                     rule ? std::string() : did_you_mean(word, known)),
                         rule ? fmt::format("write -r {} for a remapping, -p {} for a parameter; put xacro "
                                            "arguments before --ros-args",
                                            word, word)
                              : "end the ROS arguments with -- if others follow");
      }
      if (i + 1 == words.size())
        throw InputError("cli.ros_args", {}, fmt::format("a value is missing after {}", word));
      take_flag(word, words[++i], out, rules);
    } catch (const InputError& error) {
      errors.insert(errors.end(), error.diagnostics().begin(), error.diagnostics().end());
    }
  }
  if (!errors.empty()) throw InputError(std::move(errors));
}

bool applies_to(const std::string& pattern, const Node& node) {
  if (pattern.empty() || pattern.find('*') != std::string::npos) return true;
  for (const std::string* name : {&node.name(), &node.given_name()}) {
    if (pattern == *name || "/" + pattern == *name) return true;
  }
  return false;
}

}  // namespace

void report_unused(const RosArguments& arguments, Bus& bus, Diagnostics& diagnostics) {
  bus.names().report_unused(diagnostics);
  for (const auto& given : arguments.parameters) {
    const auto* parameter = std::get_if<GivenParameter>(&given);
    if (parameter == nullptr) continue;
    bool met = false, taken = false;
    std::vector<std::string> names;
    bus.each_node([&](Node& node) {
      if (!applies_to(parameter->node, node)) return;
      met = true;
      taken = taken || node.parameters().find(parameter->name) != nullptr;
      for (std::string& name : node.parameters().names()) names.push_back(std::move(name));
    });
    if (taken) continue;
    diagnostics.warning(
        "cli.parameter_unused", {},
        met ? fmt::format("-p {} has no effect: there is no parameter '{}'{}", parameter->text,
                          parameter->name, did_you_mean(parameter->name, names))
            : fmt::format("-p {} has no effect: there is no node '{}'{}", parameter->text, parameter->node,
                          did_you_mean(parameter->node, bus.nodes())),
        "correct it, or remove it");
  }
}

RosArguments take_ros_arguments(std::vector<std::string>& words, NameRules names) {
  std::vector<std::string> rules;
  return bus_detail::take_ros_arguments(words, std::move(names), rules);
}

RosArguments bus_detail::take_ros_arguments(std::vector<std::string>& words, NameRules names,
                                            std::vector<std::string>& rules) {
  RosArguments out;
  out.names = std::move(names);
  for (auto begin = std::ranges::find(words, "--ros-args"); begin != words.end();
       begin = std::ranges::find(words, "--ros-args")) {
    const auto end = std::find(begin + 1, words.end(), "--");
    const std::vector<std::string> section(begin + 1, end);
    words.erase(begin, end == words.end() ? end : end + 1);
    read_section(section, out, rules);
  }
  return out;
}

}  // namespace doppel
