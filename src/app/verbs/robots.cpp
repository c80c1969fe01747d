// doppel robots: the robots that come with the program.
#include "app/verbs/robots.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>

#include "app/description_target.h"
#include "app/output.h"
#include "app/verbs/found_controllers.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/installation.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/gazebo/sensor_reader.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel::app {

std::vector<std::string> bundled_robots() {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(data_folder() / "robots", none)) {
    if (std::filesystem::exists(entry.path() / "package.xml", none))
      names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

namespace {

struct RobotsOptions {
  bool names = false;
};

// The <description> of its package, without a full stop: what kind of robot it is.
std::string about_package(const std::filesystem::path& folder) {
  const XmlNode package = load_xml((folder / "package.xml").string());
  const XmlNode* const about = package.first("description");
  std::string text = about == nullptr ? "" : about->content();
  while (text.ends_with('.') || text.ends_with(' ')) text.pop_back();
  return text;
}

std::string robot_line(const std::string& name, std::size_t width) {
  DescriptionTarget target = open_target(name, {});
  Diagnostics findings;  // 'doppel check' prints them
  const RobotDescription robot =
      load_corrected(target.target.description, target.arguments, target.resolver, findings).robot;
  return fmt::format("{:<{}}  {:>2} joints  {:>2} sensors  {:>2} controllers  {}\n", name, width,
                     compile_model(robot, BaseKind::fixed, findings).driven_joint_names().size(),
                     read_sensors(robot, findings).size(), find_controllers(robot, target).controllers.size(),
                     about_package(data_folder() / "robots" / name));
}

int list_robots(const RobotsOptions& options) {
  const std::vector<std::string> names = bundled_robots();
  std::size_t width = 0;
  for (const std::string& name : names) width = std::max(width, name.size());
  std::string text;
  for (const std::string& name : names) text += options.names ? name + "\n" : robot_line(name, width);
  deliver(text);
  return 0;
}

}  // namespace

void add_robots(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RobotsOptions>();
  CLI::App* verb = app.add_subcommand(
      "robots", "List the bundled robots with their driven joints, sensors and controllers");
  verb->add_flag("--names", options->names, "Print only the names");
  verb->footer("Examples:\n  doppel robots\n  doppel up $(doppel robots --names | shuf -n 1)");
  verb->callback([options, &exit_code] { exit_code = list_robots(*options); });
}

}  // namespace doppel::app
