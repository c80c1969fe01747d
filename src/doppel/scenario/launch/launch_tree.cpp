// The records of a launch file for a person.
#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/shown_path.h"
#include "doppel/scenario/launch/launch_plan.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

struct Line {
  std::string subject, place, text;
  LaunchFate fate;
};

std::string title(const LaunchRecord& record) {
  const std::string words = fmt::format("{}", fmt::join(record.words, " "));
  switch (record.kind) {
    case LaunchKind::node:
      return fmt::format("{} {}", record.package, record.executable);
    case LaunchKind::process:
      return words;
    case LaunchKind::include:
      return "include " + fs::path(record.path).filename().string();
    case LaunchKind::timer:
      return fmt::format("after {:g} s", record.period);
    case LaunchKind::event:
      return record.after.empty() ? "on an event" : "after another action";
    case LaunchKind::skipped:
    case LaunchKind::unknown:
    case LaunchKind::emit:
      return record.name;
    case LaunchKind::parameter:
      return "parameter " + (record.name.empty() ? "/" : record.name);
    case LaunchKind::environment:
      return record.name;
    case LaunchKind::components:
      return "components";
    case LaunchKind::gz_server:
      return "ros_gz_sim GzServer";
    case LaunchKind::gz_spawn_model:
      return "ros_gz_sim GzSpawnModel";
    case LaunchKind::log:
      return "log";
    case LaunchKind::shutdown:
      return "shutdown";
  }
  return "";
}

std::string shortened(const std::string& text, std::size_t most) {
  return text.size() <= most ? text : text.substr(0, most - 3) + "...";
}

void add_lines(const std::vector<LaunchRecord>& records, const LaunchPlan& plan, const fs::path& folder,
               int depth, std::vector<Line>& out) {
  constexpr std::size_t kMaxSubject = 52;
  for (const LaunchRecord& record : records) {
    const auto found = plan.outcomes.find(record.id);
    Line& line = out.emplace_back();
    line.subject =
        shortened(std::string(static_cast<std::size_t>(2 * depth), ' ') + title(record), kMaxSubject);
    if (record.source.known())
      line.place = fmt::format("{}:{}", fs::path(*record.source.file).lexically_relative(folder).string(),
                               record.source.line);
    line.fate = found == plan.outcomes.end() ? LaunchFate::structure : found->second.fate;
    if (found != plan.outcomes.end()) line.text = found->second.text.substr(0, found->second.text.find('\n'));
    add_lines(record.children, plan, folder, depth + 1, out);
  }
}

const char* mark(LaunchFate fate) {
  switch (fate) {
    case LaunchFate::taken:
      return "+";
    case LaunchFate::started:
      return ">";
    case LaunchFate::absent:
      return "-";
    case LaunchFate::not_found:
    case LaunchFate::unknown:
      return "?";
    case LaunchFate::structure:
      return " ";
  }
  return " ";
}

}  // namespace

std::string launch_tree(const LaunchDescription& description, const LaunchPlan& plan,
                        const fs::path& folder) {
  std::vector<Line> lines;
  add_lines(description.records, plan, folder, 0, lines);
  std::size_t subjects = 0, places = 0;
  for (const Line& line : lines) {
    subjects = std::max(subjects, line.subject.size());
    places = std::max(places, line.place.size());
  }
  std::string out;
  for (const Line& line : lines) {
    std::string row = fmt::format("{} {:<{}}  {:<{}}  {}", mark(line.fate), line.subject, subjects,
                                  line.place, places, line.text);
    row.erase(row.find_last_not_of(' ') + 1);
    out += row + "\n";
  }
  return out;
}

}  // namespace doppel
