#include "doppel/validation/extras/detail/test_paths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "doppel/robot/ik/task_space.h"

namespace doppel {
namespace {

constexpr double kSpacing = 0.01;      // of the edge, between points
constexpr double kMaxJointStep = 0.3;  // rad or m between points: more is another branch
constexpr std::size_t kLook = 4;       // points from one look at contacts to the next
constexpr double kDiameter = 0.8;      // of the edge
constexpr double kUnlimited = 1.0;     // m/s of an arm without speed limits

using Points = std::vector<Eigen::Vector3d>;

void append_line(Points& out, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double spacing) {
  const int count = std::max(2, static_cast<int>(std::ceil((b - a).norm() / spacing)));
  for (int i = out.empty() ? 0 : 1; i <= count; ++i) out.push_back(a + (b - a) * i / count);
}

// From the angle `begin` to `end`, from `u` towards `v`.
Points arc(const Eigen::Vector3d& centre, const Eigen::Vector3d& u, const Eigen::Vector3d& v, double begin,
           double end, double spacing) {
  const int count = static_cast<int>(std::ceil((end - begin) * u.norm() / spacing));
  Points out;
  for (int i = 0; i <= count; ++i) {
    const double angle = begin + (end - begin) * i / count;
    out.push_back(centre + std::cos(angle) * u + std::sin(angle) * v);
  }
  return out;
}

class PathFinder {
 public:
  PathFinder(const CheckContext& context, const ExtraArm& arm, const TestPlane& plane)
      : arm_(arm),
        plane_(plane),
        touch_(context),
        reach_(arm.reach()),
        task_(plane.orientation ? find_task_space(arm.chain()).task : IkTask::position),
        data_(arm.model()) {
    for (const Eigen::VectorXd& q : plane.q) {
      forward_kinematics(arm.model(), data_, q);
      poses_.push_back(data_.X_WL[static_cast<std::size_t>(arm.chain().tip_link)]);
    }
  }

  [[nodiscard]] const Eigen::Vector3d place(std::size_t pose) const { return poses_[pose].translation(); }
  [[nodiscard]] bool has_extent() const {
    constexpr double kMinSide = 1e-3;  // m
    return plane_.edge > kMinSide && (place(1) - place(2)).norm() > kMinSide &&
           (place(2) - place(3)).norm() > kMinSide;
  }
  [[nodiscard]] double spacing() const { return kSpacing * plane_.edge; }

  // nullopt: the arm cannot follow, and why() says what it is.
  std::optional<TestPath> follow(std::string name, const Points& points, std::size_t nearest_pose) {
    TestPath out;
    out.name = std::move(name);
    ReachQuery query;
    query.X_WT = poses_.front();
    query.task = task_;
    query.q = plane_.q[nearest_pose];
    for (std::size_t i = 0; i < points.size(); ++i) {
      query.X_WT.translation() = points[i];
      const ReachAnswer answer = reach_.answer(query);
      if (!answer.solved) return refuse("is not reached as a whole");
      const Eigen::VectorXd& q = answer.branches.front().q;
      if (i > 0 && (q - query.q).cwiseAbs().maxCoeff() > kMaxJointStep)
        return refuse("needs another branch of the arm on its way");
      if (i % kLook == 0 && !touch_.is_free(arm_.model(), q)) return refuse("touches something");
      query.q = q;
      add_point(q, out);
    }
    out.end = out.way.size();
    out.speed = largest_speed(out);
    return out;
  }
  [[nodiscard]] const std::string& why() const { return why_; }

 private:
  std::nullopt_t refuse(const char* why) {
    why_ = why;
    return std::nullopt;
  }

  void add_point(const Eigen::VectorXd& q, TestPath& out) {
    forward_kinematics(arm_.model(), data_, q);
    out.X_RT.push_back(data_.X_WL.front().inverse() *
                       data_.X_WL[static_cast<std::size_t>(arm_.chain().tip_link)]);
    out.u.push_back(arm_.chain().variables_of(arm_.model(), q));
    const std::size_t i = out.X_RT.size() - 1;
    out.way.push_back(
        i == 0 ? 0 : out.way.back() + (out.X_RT[i].translation() - out.X_RT[i - 1].translation()).norm());
  }

  [[nodiscard]] double largest_speed(const TestPath& path) const {
    double out = kInfinity;
    for (std::size_t i = 1; i < path.u.size(); ++i) {
      for (int k = 0; k < arm_.chain().size(); ++k) {
        const double rate =
            std::abs(path.u[i][k] - path.u[i - 1][k]) / std::max(1e-9, path.way[i] - path.way[i - 1]);
        if (rate > 1e-9) out = std::min(out, arm_.joint(k).velocity / rate);
      }
    }
    return std::isfinite(out) ? out : kUnlimited;
  }

  const ExtraArm& arm_;
  const TestPlane& plane_;
  TwinTouch touch_;
  ArmReach reach_;
  IkTask task_;
  Data data_;
  std::vector<Pose> poses_;
  std::string why_;
};

}  // namespace

Eigen::VectorXd TestPath::at(double distance) const {
  const auto next = static_cast<std::size_t>(std::ranges::upper_bound(way, distance) - way.begin());
  if (next == 0) return u.front();
  if (next == way.size()) return u.back();
  const double share = (distance - way[next - 1]) / (way[next] - way[next - 1]);
  return u[next - 1] + share * (u[next] - u[next - 1]);
}

std::vector<TestPath> test_paths(const CheckContext& context, const ExtraArm& arm, const TestPlane& plane,
                                 std::vector<std::string>& why) {
  constexpr double kTurn = 2 * std::numbers::pi, kRun = 0.25 * kTurn;  // rad
  PathFinder finder(context, arm, plane);
  std::vector<TestPath> out;
  // An arm that only turns its tool has its test poses in one place.
  if (!finder.has_extent()) {
    why.emplace_back("its tool moves too little for a path");
    return out;
  }
  const auto add = [&](const char* name, const Points& points, std::size_t pose) {
    auto path = finder.follow(name, points, pose);
    if (path)
      out.push_back(std::move(*path));
    else
      why.push_back(fmt::format("the {} {}", name, finder.why()));
    return path.has_value();
  };
  const Eigen::Vector3d centre = finder.place(0), p2 = finder.place(1), p3 = finder.place(2),
                        p4 = finder.place(3);
  Points line, corner;
  append_line(line, p2, p4, finder.spacing());
  add("line", line, 1);

  const double radius = 0.5 * kDiameter * plane.edge;
  const Eigen::Vector3d u = radius * (p2 - p3).normalized(), v = radius * (p3 - p4).normalized();
  if (add("circle", arc(centre, u, v, -kRun, kTurn + kRun, finder.spacing()), 0)) {
    TestPath& circle = out.back();
    const double first = circle.length() * kRun / (kTurn + 2 * kRun);
    circle.begin =
        static_cast<std::size_t>(std::ranges::lower_bound(circle.way, first - 1e-9) - circle.way.begin());
    circle.end = circle.way.size() - circle.begin;
  }

  append_line(corner, p2, p3, finder.spacing());
  append_line(corner, p3, p4, finder.spacing());
  if (add("corner", corner, 1)) {
    out.back().corner = p3;
    out.back().before = p3 - p2;
    out.back().after = p4 - p3;
  }
  return out;
}

double PathProfile::way(double now) const {
  const auto rise = [this](double time) {  // the integral of quintic()
    const double x = std::clamp(time / ramp_time(), 0.0, 1.0);
    return speed * ramp_time() * x * x * x * x * (2.5 + x * (x - 3));
  };
  if (now <= ramp_time()) return rise(now);
  if (now >= time() - ramp_time()) return length - rise(time() - now);
  return ramp + speed * (now - ramp_time());
}

}  // namespace doppel
