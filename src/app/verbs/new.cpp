// doppel new NAME: creates a description package.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "app/output.h"
#include "app/process.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/description/scaffold/arm_package.h"
#include "doppel/description/scaffold/write_package.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct NewOptions {
  std::string name, folder = ".", maintainer, email, licence = "TODO: License declaration";
  scaffold::ArmRequest arm;
};

// The defaults of `ros2 pkg create`.
scaffold::PackageAuthor author_of(const NewOptions& options) {
  const char* user = std::getenv("USER");
  const std::string name = user == nullptr || *user == '\0' ? "user" : user;
  return {options.maintainer.empty() ? name : options.maintainer,
          options.email.empty() ? name + "@todo.todo" : options.email, options.licence};
}

int run_new(const NewOptions& options) {
  const scaffold::PackageName name = scaffold::package_name(options.name);
  const scaffold::ArmDesign design = scaffold::design_arm(options.arm);
  const fs::path folder = fs::absolute(options.folder).lexically_normal() / name.package;
  const auto files = scaffold::arm_package(name, design, author_of(options));
  scaffold::write_package(folder, files);
  const std::string shown = shell_quoted(shown_path(folder));
  std::string text = fmt::format("{}: {}\n", shown, scaffold::summary(design));
  for (const scaffold::PackageFile& file : files) text += fmt::format("  {}\n", file.path);
  text += fmt::format(
      "\nNext:\n  doppel check {0}\n  doppel up {0}\nand from another shell:\n  doppel move {1} --in 2\n",
      shown, scaffold::example_move(design));
  if (design.servo != nullptr)
    text += fmt::format(
        "The servos, emulated until you have them (ids and port: {0}/config/hardware.yaml):\n"
        "  doppel emulate {0}\n  doppel hardware scan\n  doppel up {0} use_sim:=false\n",
        shown);
  deliver(text);
  return 0;
}

}  // namespace

void add_new(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<NewOptions>();
  CLI::App* verb = app.add_subcommand("new", "Make a description package for an arm of your own");
  verb->add_option("NAME", options->name, "The robot's name; the package is NAME_description")->required();
  verb->add_option("--dof", options->arm.dof, "Joints of the arm, 1 to 16")->capture_default_str();
  verb->add_flag("--gripper", options->arm.gripper, "With a gripper of two fingers");
  verb->add_option("--reach", options->arm.reach,
                   "From the shoulder to the tool, m; default: by the number of joints");
  verb->add_option(
      "--payload", options->arm.payload,
      "What it carries stretched out, kg: the effort limits follow; default: 0.5, of servos 0.05");
  verb->add_option(
      "--servos", options->arm.servos,
      "Servos that drive it: feetech, dynamixel, or servo_line (hobby servos behind a board), with "
      "their driver and config/hardware.yaml");
  verb->add_option("--in", options->folder, "The folder to make the package in")->capture_default_str();
  verb->add_option("--maintainer", options->maintainer, "For package.xml; default: the user's name");
  verb->add_option("--email", options->email, "For package.xml");
  verb->add_option("--license", options->licence, "For package.xml, for instance Apache-2.0");
  verb->footer(
      "Examples:\n  doppel new my_arm\n  doppel new my_arm --dof 4 --gripper\n"
      "  doppel new my_arm --servos feetech      # then: doppel emulate my_arm\n"
      "  doppel new big_arm --dof 7 --reach 1.4 --payload 5 --in ~/ros2_ws/src --license Apache-2.0");
  verb->callback([options, &exit_code] { exit_code = run_new(*options); });
}

}  // namespace doppel::app
