#include <algorithm>
#include <array>
#include <ctime>
#include <deque>
#include <map>
#include <numbers>
#include <set>

#include "app/number_checks.h"
#include "app/output.h"
#include "app/verbs/shell.h"
#include "app/verbs/tf_frames.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/base/math/pose.h"
#include "doppel/review/conversion/tree.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kLookupTimeout = std::chrono::seconds(2);

struct TfOptions {
  std::string parent, child;
  bool once = false;
  double rate = 1;
  std::string pdf, svg;  // of view_frames
  bool dot = false;
  double seconds = 5;
};

void print_transform(const Pose& X, Time stamp) {
  const Eigen::Quaterniond q(X.linear());
  const Eigen::Vector3d rpy = rpy_from_rotation(X.linear());
  const Eigen::Vector3d degrees = rpy * (180 / std::numbers::pi);
  std::string out = fmt::format("At time {:.9f}\n", to_seconds(stamp));
  out += fmt::format("- Translation: [{:.3f}, {:.3f}, {:.3f}]\n", X.translation().x(), X.translation().y(),
                     X.translation().z());
  out += fmt::format("- Rotation: in Quaternion (xyzw) [{:.3f}, {:.3f}, {:.3f}, {:.3f}]\n", q.x(), q.y(),
                     q.z(), q.w());
  out += fmt::format("- Rotation: in RPY (radian) [{:.3f}, {:.3f}, {:.3f}]\n", rpy.x(), rpy.y(), rpy.z());
  out += fmt::format("- Rotation: in RPY (degree) [{:.3f}, {:.3f}, {:.3f}]\n", degrees.x(), degrees.y(),
                     degrees.z());
  out += "- Matrix:\n";
  for (int row = 0; row < 4; ++row) {
    out += fmt::format(" {:6.3f} {:6.3f} {:6.3f} {:6.3f}\n", X.matrix()(row, 0), X.matrix()(row, 1),
                       X.matrix()(row, 2), X.matrix()(row, 3));
  }
  print_out(out);
}

void check_frame(const TfFrames& frames, const std::string& name) {
  const std::vector<std::string> names = frames.names();
  if (std::ranges::find(names, name) != names.end()) return;
  throw ClientError(fmt::format("there is no frame '{}'{}", name, did_you_mean(name, names)));
}

int echo_transform(Shell& shell, const TfOptions& options) {
  Shell::catch_interrupts();
  try {
    TfFrames frames(shell.twin());
    Pose X;
    Time stamp{};
    const auto found = [&] { return frames.look_up(options.parent, options.child, X, stamp); };
    // A frame that was not received yet is its own root, so the result is only valid for known frames.
    const auto known = [&] {
      return (frames.has_dynamic() || !frames.moving_expected()) && frames.has_static() && found();
    };
    if (!frames.gather(known, Clock::now() + kLookupTimeout) && !found()) {
      check_frame(frames, options.parent);
      check_frame(frames, options.child);
      throw ClientError(
          fmt::format("'{}' and '{}' are not connected in the tf tree", options.parent, options.child));
    }
    check_frame(frames, options.parent);
    check_frame(frames, options.child);
    const auto period =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / options.rate));
    for (auto due = Clock::now() + period;; due += period) {
      print_transform(X, stamp);
      if (options.once) return 0;
      static_cast<void>(frames.gather([] { return false; }, due));
      static_cast<void>(found());
    }
  } catch (const Interrupted&) {
    return 0;
  }
}

void print_subtree(const std::multimap<std::string, std::string>& children, const TfFrames& frames,
                   const std::string& name, const std::string& indent) {
  const auto [first, last] = children.equal_range(name);
  for (auto it = first; it != last; ++it) {
    const bool is_last = std::next(it) == last;
    print_line("{}{} {}{}\n", indent, is_last ? "└─" : "├─", it->second,
               frames.all().at(it->second).fixed ? "  (fixed)" : "");
    print_subtree(children, frames, it->second, indent + (is_last ? "   " : "│  "));
  }
}

// Throws ClientError if there are no frames.
void gather_tree(TfFrames& frames) {
  if (!frames.gather_all() && frames.all().empty())
    throw ClientError("no message has arrived on /tf or /tf_static; is the twin paused?");
  if (!frames.has_dynamic() && frames.moving_expected())
    print_note("note: no message arrives on /tf, so moving frames are missing; is the twin paused?");
}

int tree(Shell& shell, const TfOptions&) {
  TfFrames frames(shell.twin());
  gather_tree(frames);
  std::multimap<std::string, std::string> children;
  std::set<std::string> roots;
  for (const auto& [name, frame] : frames.all()) {
    children.emplace(frame.parent, name);
    if (!frames.all().contains(frame.parent)) roots.insert(frame.parent);
  }
  for (const std::string& root : roots) {
    print_line("{}\n", root);
    print_subtree(children, frames, root, "");
  }
  return 0;
}

// The text that view_frames of tf2_tools prints about a transform, without the frame that it leads to.
std::vector<std::string> transform_lines(const TfFrames& frames, const TfFrame& frame) {
  const double span = to_seconds(frame.stamp - frame.first_stamp);
  std::vector<std::string> lines = {
      frame.fixed ? "/tf_static" : "/tf",
      fmt::format("Broadcaster: {}", fmt::join(frames.broadcasters(frame.fixed), " or "))};
  if (frame.fixed) return lines;
  lines.push_back(span > 0
                      ? fmt::format("Average rate: {:.3f} Hz", static_cast<double>(frame.count - 1) / span)
                      : "Average rate: one message");
  lines.push_back(fmt::format("Most recent transform: {:.6f}", to_seconds(frame.stamp)));
  lines.push_back(fmt::format("Buffer length: {:.3f} s", span));
  return lines;
}

// Frames from the roots on, parents before their children.
std::vector<TreeCard> frame_cards(const TfFrames& frames) {
  std::vector<TreeCard> cards;
  std::multimap<std::string, std::string> children;
  std::deque<std::pair<std::string, int>> pending;  // with the parent's index
  for (const std::string& name : frames.names()) {
    const auto found = frames.all().find(name);
    if (found == frames.all().end()) {
      pending.emplace_back(name, -1);
    } else {
      children.emplace(found->second.parent, name);
    }
  }
  for (; !pending.empty(); pending.pop_front()) {
    const auto [name, parent] = pending.front();
    TreeCard card{.node = {name}, .edge = {}, .tone = Tone::fixed, .parent = parent};
    if (parent >= 0) {
      const TfFrame& frame = frames.all().at(name);
      card.edge = transform_lines(frames, frame);
      if (!frame.fixed) card.tone = Tone::revolute;
    }
    const int index = static_cast<int>(cards.size());
    cards.push_back(std::move(card));
    const auto [first, last] = children.equal_range(name);
    for (auto it = first; it != last; ++it) pending.emplace_back(it->second, index);
  }
  return cards;
}

// "frames_2026-11-24_19.30.05", as view_frames of tf2_tools names its files.
std::string dated_name() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  std::array<char, 64> text{};
  std::strftime(text.data(), text.size(), "frames_%Y-%m-%d_%H.%M.%S", &local);
  return text.data();
}

int view_frames(Shell& shell, const TfOptions& options) {
  const std::string pdf =
      options.pdf.empty() && options.svg.empty() && !options.dot ? dated_name() + ".pdf" : options.pdf;
  Shell::catch_interrupts();
  TfFrames frames(shell.twin());
  gather_tree(frames);
  if (frames.moving_expected()) {
    print_note(fmt::format("listening for {:g} s ...", options.seconds));
    const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                          std::chrono::duration<double>(options.seconds));
    static_cast<void>(frames.gather([] { return false; }, until));
  }
  const std::vector<TreeCard> cards = frame_cards(frames);
  if (options.dot) deliver(tree_dot("frames", cards));
  const Drawing drawing = tree_drawing("Frames received on /tf and /tf_static", cards);
  if (!options.svg.empty()) deliver(to_svg(drawing), options.svg);
  if (!pdf.empty()) deliver(to_pdf(drawing), pdf);
  for (const std::string& file : {options.svg, pdf}) {
    if (!file.empty() && file != "-") print_note(fmt::format("{}: {} frames", file, cards.size()));
  }
  return 0;
}

}  // namespace

void add_tf(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "tf", "Show frames and transforms",
                              "doppel tf tree\n  doppel tf echo world tool_link_1");
  add_verb<TfOptions>(
      group, "echo", "Print the transform between two frames", "doppel tf echo world tool_link_1", exit_code,
      [](CLI::App& verb, TfOptions& options) {
        verb.add_option("parent", options.parent, "Source frame")->required();
        verb.add_option("child", options.child, "Target frame")->required();
        verb.add_flag("--once", options.once, "Print once and exit");
        verb.add_option("-r,--rate", options.rate, "Rate in Hz (default 1)")->check(positive_number());
      },
      echo_transform);
  add_verb<TfOptions>(
      group, "tree", "Print the tree of all frames", "doppel tf tree", exit_code,
      [](CLI::App&, TfOptions&) {}, tree);
  add_verb<TfOptions>(
      group, "view_frames", "Draw the tree of all frames with broadcasters and rates: PDF, SVG, Graphviz",
      "doppel tf view_frames                    # frames_TIME.pdf\n  doppel tf view_frames --pdf "
      "frames.pdf\n  "
      "doppel tf view_frames --dot | dot -Tpng > frames.png",
      exit_code,
      [](CLI::App& verb, TfOptions& options) {
        verb.add_option("--pdf", options.pdf, "File to write (-: stdout; default frames_TIME.pdf)")
            ->type_name("FILE");
        verb.add_option("--svg", options.svg, "Write the drawing to this file (-: stdout)")
            ->type_name("FILE");
        verb.add_flag("--dot", options.dot, "Print Graphviz dot to stdout");
        verb.add_option("--wait-time", options.seconds,
                        "Seconds for which transforms are received (default 5)")
            ->check(positive_number());
      },
      view_frames);
}

}  // namespace doppel::app
