// doppel tree: links and joints as text, Graphviz, SVG and PDF.
#include "doppel/review/conversion/tree.h"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <memory>

#include "app/description_target.h"
#include "app/output.h"
#include "app/verbs/verbs.h"

namespace doppel::app {
namespace {

struct TreeOptions {
  std::vector<std::string> target;
  std::string svg, pdf;
  bool dot = false, frames = false, ascii = false;
};

// The same result as from the C library, without setting a locale.
bool terminal_knows_unicode() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* value = std::getenv(name);
    if (value == nullptr || *value == '\0') continue;
    const std::string text = value;
    return text.find("UTF-8") != std::string::npos || text.find("utf8") != std::string::npos;
  }
  return false;
}

int run_tree(const TreeOptions& options) {
  DescriptionTarget target = open_target(options.target);
  const RobotDescription robot = load_target(target).robot;
  if (!options.svg.empty() || !options.pdf.empty()) {
    const Drawing drawing = options.frames ? frames_drawing(robot) : tree_drawing(robot);
    if (!options.svg.empty()) deliver(to_svg(drawing), options.svg);
    if (!options.pdf.empty()) deliver(to_pdf(drawing), options.pdf);
    return 0;
  }
  if (options.dot) {
    deliver(options.frames ? frames_dot(robot) : tree_dot(robot));
    return 0;
  }
  const bool unicode = !options.ascii && terminal_knows_unicode();
  deliver(options.frames ? frames_text(robot, unicode) : tree_text(robot, unicode));
  return 0;
}

}  // namespace

void add_tree(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<TreeOptions>();
  CLI::App* verb = app.add_subcommand("tree", "Print the tree of links and joints: text, Graphviz, SVG, PDF");
  add_target(*verb, options->target);
  verb->add_flag("--frames", options->frames, "Print the tree of frames, as tf2_tools view_frames does");
  verb->add_flag("--dot", options->dot, "Print Graphviz dot to stdout");
  verb->add_option("--svg", options->svg, "Write the drawing to this file (-: stdout)")->type_name("FILE");
  verb->add_option("--pdf", options->pdf, "Write the drawing to this file (-: stdout)")->type_name("FILE");
  verb->add_flag("--ascii", options->ascii, "No box-drawing characters (default: by the locale)");
  verb->footer(
      "Examples:\n"
      "  doppel tree omarm_one\n"
      "  doppel tree my_arm.urdf.xacro --svg arm.svg --pdf arm.pdf\n"
      "  doppel tree my_arm.urdf --frames --pdf frames.pdf\n"
      "  doppel tree my_arm.urdf --dot | dot -Tpng > arm.png");
  verb->callback([options, &exit_code] { exit_code = run_tree(*options); });
}

}  // namespace doppel::app
