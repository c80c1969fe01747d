#include <algorithm>
#include <map>
#include <numbers>
#include <set>

#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/core/names.h"
#include "doppel/math/pose.h"
#include "doppel/messages/tf2_msgs.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kFramesTimeout = std::chrono::seconds(2);

struct TfOptions {
  std::string parent, child;
  bool once = false;
  double rate = 1;
};

struct Frame {
  std::string parent;
  Pose X_PF = Pose::Identity();  // this frame in its parent
  Time stamp{};
  bool fixed = false;
};

// The tree of frames from /tf and /tf_static.
class Frames {
 public:
  explicit Frames(Client& twin) : twin_(twin) {
    for (const std::string& topic : {fixed_topic_, moving_topic_}) {
      if (twin_.topics().contains(topic)) twin_.subscribe(topic);
    }
  }

  // Receives transforms until `enough`, or until the timeout (false).
  bool gather(const std::function<bool()>& enough, Clock::time_point until) {
    while (!enough()) {
      Client::Received message;
      if (!twin_.next(message, until)) return false;
      take(message);
    }
    return true;
  }

  [[nodiscard]] bool has_dynamic() const { return has_dynamic_; }
  [[nodiscard]] bool has_static() const { return has_static_; }
  [[nodiscard]] bool moving_expected() const {
    const auto found = twin_.topics().find(moving_topic_);
    return found != twin_.topics().end() && !found->second.publishers.empty();
  }
  [[nodiscard]] const std::map<std::string, Frame>& all() const { return frames_; }
  [[nodiscard]] std::vector<std::string> names() const {
    std::set<std::string> names;
    for (const auto& [name, frame] : frames_) names.insert({name, frame.parent});
    return {names.begin(), names.end()};
  }
  // `child` in `parent`, if both are in one tree; `stamp`: the latest on the path.
  [[nodiscard]] bool look_up(const std::string& parent, const std::string& child, Pose& X,
                             Time& stamp) const {
    Pose X_RootP, X_RootC;
    stamp = Time{};
    if (root_of(parent, X_RootP, stamp) != root_of(child, X_RootC, stamp)) return false;
    X = X_RootP.inverse() * X_RootC;
    return true;
  }

 private:
  // With --ns those of the selected robot, without prefixes.
  const std::string moving_topic_ = absolute("tf"), fixed_topic_ = absolute("tf_static");

  void take(const Client::Received& message) {
    const bool fixed = message.topic == fixed_topic_;
    (fixed ? has_static_ : has_dynamic_) = true;
    for (const auto& t : decode<tf2_msgs::msg::TFMessage>(message.cdr).transforms) {
      Frame& frame = frames_[t.child_frame_id];
      const auto& p = t.transform.translation;
      const auto& r = t.transform.rotation;
      frame.parent = t.header.frame_id;
      frame.X_PF = Eigen::Translation3d(p.x, p.y, p.z) * Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized();
      frame.stamp = from_msg(t.header.stamp);
      frame.fixed = fixed;
    }
  }

  std::string root_of(std::string name, Pose& X_RootF, Time& stamp) const {
    X_RootF = Pose::Identity();
    for (std::size_t steps = 0; steps <= frames_.size(); ++steps) {  // bounded: a loop has no root
      const auto found = frames_.find(name);
      if (found == frames_.end()) return name;
      X_RootF = found->second.X_PF * X_RootF;
      if (!found->second.fixed) stamp = std::max(stamp, found->second.stamp);
      name = found->second.parent;
    }
    throw ClientError(fmt::format("the frames around {} form a loop", name));
  }

  Client& twin_;
  std::map<std::string, Frame> frames_;
  bool has_dynamic_ = false, has_static_ = false;
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

void check_frame(const Frames& frames, const std::string& name) {
  const std::vector<std::string> names = frames.names();
  if (std::ranges::find(names, name) != names.end()) return;
  throw ClientError(fmt::format("there is no frame '{}'{}", name, did_you_mean(name, names)));
}

int echo_transform(Shell& shell, const TfOptions& options) {
  Shell::catch_interrupts();
  try {
    Frames frames(shell.twin());
    Pose X;
    Time stamp{};
    const auto found = [&] { return frames.look_up(options.parent, options.child, X, stamp); };
    // A frame that was not received yet is its own root, so the result is only valid for known frames.
    const auto known = [&] {
      return (frames.has_dynamic() || !frames.moving_expected()) && frames.has_static() && found();
    };
    if (!frames.gather(known, Clock::now() + kFramesTimeout) && !found()) {
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

void print_subtree(const std::multimap<std::string, std::string>& children, const Frames& frames,
                   const std::string& name, const std::string& indent) {
  const auto [first, last] = children.equal_range(name);
  for (auto it = first; it != last; ++it) {
    const bool is_last = std::next(it) == last;
    print_line("{}{} {}{}\n", indent, is_last ? "└─" : "├─", it->second,
               frames.all().at(it->second).fixed ? "  (fixed)" : "");
    print_subtree(children, frames, it->second, indent + (is_last ? "   " : "│  "));
  }
}

int tree(Shell& shell, const TfOptions&) {
  Frames frames(shell.twin());
  const auto enough = [&] {
    return frames.has_static() && (frames.has_dynamic() || !frames.moving_expected());
  };
  if (!frames.gather(enough, Clock::now() + kFramesTimeout) && frames.all().empty()) {
    throw ClientError("no message has arrived on /tf or /tf_static; is the twin paused?");
  }
  if (!frames.has_dynamic() && frames.moving_expected()) {
    print_note("note: no message arrives on /tf, so moving frames are missing; is the twin paused?");
  }
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

}  // namespace

void add_tf(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "tf", "Show frames and transforms");
  add_verb<TfOptions>(
      group, "echo", "Print the transform between two frames", "doppel tf echo world tool_link_1", exit_code,
      [](CLI::App& verb, TfOptions& options) {
        verb.add_option("parent", options.parent, "Source frame")->required();
        verb.add_option("child", options.child, "Target frame")->required();
        verb.add_flag("--once", options.once, "Print once and exit");
        verb.add_option("-r,--rate", options.rate, "Rate in Hz (default 1)")->check(CLI::PositiveNumber);
      },
      echo_transform);
  for (const char* name : {"tree", "view_frames"}) {
    add_verb<TfOptions>(
        group, name, "Print the tree of all frames", fmt::format("doppel tf {}", name), exit_code,
        [](CLI::App&, TfOptions&) {}, tree);
  }
}

}  // namespace doppel::app
