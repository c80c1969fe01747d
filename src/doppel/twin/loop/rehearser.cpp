#include "doppel/twin/loop/detail/rehearser.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "doppel/base/core/guarded_thread.h"
#include "doppel/devices/drivers/motion_guard.h"

namespace doppel {
namespace {

constexpr std::int64_t kMaxRows = 20'000;   // commands of a path
constexpr Duration kSettling{300'000'000};  // after the path
constexpr double kPastLimit = 1e-3;         // rad or m
constexpr double kSpeedMargin = 1.05;       // of the speed limit: of splines between slower points
constexpr double kWholeEffort = 0.99;       // of the effort limit
// rad, m that a joint with the whole effort may be behind.
constexpr double kBehind = 0.1, kSlideBehind = 0.01;
constexpr Duration kBehindTime{50'000'000};

// The commands of a path, and the copy of the engine that gets them.
struct RehearsedMotion {
  std::unique_ptr<Engine> engine;
  int instance = 0;
  std::shared_ptr<const GuardScene> scene;
  std::vector<int> joints;
  std::vector<double> rows;  // [rows, joints]
  Duration period{};         // between two rows

  [[nodiscard]] std::size_t size() const { return rows.size() / joints.size(); }
  [[nodiscard]] double command(std::size_t row, std::size_t i) const { return rows[row * joints.size() + i]; }
};

class MotionRun {
 public:
  explicit MotionRun(RehearsedMotion& motion)
      : motion_(motion),
        robot_(motion.engine->instance(motion.instance)),
        model_(robot_.model()),
        context_(motion.scene->scene()),
        behind_since_(motion.joints.size(), kNotBehind) {
    set_configuration();
    for (const std::size_t pair : motion.scene->pairs()) {
      if (!context_.tested_closer(pair, kTouching)) pairs_.push_back(pair);
    }
    for (std::size_t link = 0; link < model_.links.size(); ++link) {
      for (const int joint : drivers_of(model_, static_cast<int>(link))) {
        if (looks_like_gripper(model_.joints[static_cast<std::size_t>(joint)].name))
          fingers_.insert(static_cast<int>(link));
      }
    }
    motion.engine->contacts(contacts_);
    for (const Contact& one : contacts_) at_start_.insert({one.a, one.b});
  }

  Status run(const std::atomic<bool>& given_up) {
    const Duration step = motion_.engine->world().settings().step;
    const auto steps = std::max<std::int64_t>(1, motion_.period / step);
    const auto after = static_cast<std::size_t>(kSettling / motion_.period);
    Status out;
    for (std::size_t row = 0; row < motion_.size() + after && out && !given_up; ++row) {
      since_ = motion_.period * static_cast<std::int64_t>(row);
      row_ = std::min(row, motion_.size() - 1);
      if (row < motion_.size()) out = check_commands();
      for (std::size_t i = 0; i < motion_.joints.size(); ++i)
        robot_.set_target(motion_.joints[i], motion_.command(row_, i));
      for (std::int64_t i = 0; i < steps && out; ++i) motion_.engine->step();
      if (out) out = check_state();
    }
    return out;
  }

 private:
  static constexpr Duration kNotBehind = Duration::max();

  [[nodiscard]] const ModelJoint& joint(std::size_t i) const {
    return model_.joints[static_cast<std::size_t>(motion_.joints[i])];
  }
  [[nodiscard]] bool is_slide(std::size_t i) const { return joint(i).type == JointType::prismatic; }
  [[nodiscard]] const char* unit(std::size_t i) const { return is_slide(i) ? "m" : "rad"; }
  [[nodiscard]] double q(std::size_t i) const { return robot_.q()[static_cast<std::size_t>(joint(i).q)]; }
  void set_configuration() {
    const std::span<const double> q = robot_.q();
    context_.set_configuration(0, Eigen::Map<const Eigen::VectorXd>(q.data(), model_.nq));
  }
  [[nodiscard]] Status refuse(const std::string& what, Duration when) const {
    return Status::refused(fmt::format("{} at {:.2f} s", what, to_seconds(when)));
  }

  [[nodiscard]] Status check_commands() const {
    for (std::size_t i = 0; i < motion_.joints.size(); ++i) {
      const ModelJoint& one = joint(i);
      const double command = motion_.command(row_, i);
      if (command < one.lower - kPastLimit || command > one.upper + kPastLimit)
        return refuse(fmt::format("'{}' would be commanded to {:.3f} {}, beyond its limit of {:.3f},",
                                  one.name, command, unit(i), command < one.lower ? one.lower : one.upper),
                      since_);
      const double before = motion_.command(row_ == 0 ? 0 : row_ - 1, i);
      const double speed = std::abs(command - before) / to_seconds(motion_.period);
      if (speed > kSpeedMargin * one.velocity)
        return refuse(
            fmt::format("'{0}' would be commanded at {1:.3f} {3}/s, faster than its limit of {2:.3f} {3}/s,",
                        one.name, speed, one.velocity, unit(i)),
            since_);
    }
    return {};
  }

  [[nodiscard]] Status check_state() {
    if (motion_.engine->diverged()) return refuse("the physics would diverge", since_);
    for (std::size_t i = 0; i < motion_.joints.size(); ++i) {
      if (Status strong = check_effort(i); !strong) return strong;
    }
    set_configuration();
    for (const std::size_t pair : pairs_) {
      if (context_.tested_closer(pair, kTouching))
        return refuse(motion_.scene->sentence(pair, "would"), since_);
    }
    return check_contacts();
  }

  [[nodiscard]] Status check_effort(std::size_t i) {
    const auto index = static_cast<std::size_t>(motion_.joints[i]);
    const double limit = robot_.made_of().servos[index].effort;
    const double behind = std::abs(motion_.command(row_, i) - q(i));
    const bool weak = std::isfinite(limit) &&
                      std::abs(robot_.drive_effort()[index]) >= kWholeEffort * limit &&
                      behind > (is_slide(i) ? kSlideBehind : kBehind);
    if (!weak || looks_like_gripper(joint(i).name)) {
      behind_since_[i] = kNotBehind;
      return {};
    }
    behind_since_[i] = std::min(behind_since_[i], since_);
    if (since_ - behind_since_[i] < kBehindTime) return {};
    return refuse(
        fmt::format("'{}' would need more than its effort limit of {:g} {}, and stay {:.2f} {} behind,",
                    joint(i).name, limit, is_slide(i) ? "N" : "N m", behind, unit(i)),
        behind_since_[i]);
  }

  // With bodies that are no part of the robot; its own links are those of the scene.
  [[nodiscard]] Status check_contacts() {
    motion_.engine->contacts(contacts_);
    for (const Contact& one : contacts_) {
      const bool a_is_own = one.a.instance == motion_.instance, b_is_own = one.b.instance == motion_.instance;
      if (a_is_own == b_is_own || one.depth <= 0 || at_start_.contains({one.a, one.b})) continue;
      const BodyId link = a_is_own ? one.a : one.b, other = a_is_own ? one.b : one.a;
      if (fingers_.contains(link.link) && is_movable(other)) continue;
      return refuse(
          fmt::format("'{}' would touch '{}'", model_.links[static_cast<std::size_t>(link.link)].name,
                      motion_.engine->world().name_of(other)),
          since_);
    }
    return {};
  }
  [[nodiscard]] bool is_movable(BodyId body) const {
    return !body.is_ground() && motion_.engine->instance(body.instance).model().nv > 0;
  }

  struct Before {
    bool operator()(const std::pair<BodyId, BodyId>& x, const std::pair<BodyId, BodyId>& y) const {
      const auto key = [](const std::pair<BodyId, BodyId>& one) {
        return std::tuple(one.first.instance, one.first.link, one.second.instance, one.second.link);
      };
      return key(x) < key(y);
    }
  };

  RehearsedMotion& motion_;
  Instance robot_;
  const Model& model_;
  CollisionContext context_;
  std::vector<std::size_t> pairs_;  // without those that touch at the beginning
  std::set<std::pair<BodyId, BodyId>, Before> at_start_;
  std::set<int> fingers_;  // links that a gripper's joint moves
  std::vector<Contact> contacts_;
  std::vector<Duration> behind_since_;
  std::size_t row_ = 0;
  Duration since_{};
};

class EngineRehearsal : public Rehearsal {
 public:
  EngineRehearsal(RehearsedMotion motion, bool beside_loop) : motion_(std::move(motion)) {
    const auto work = [this] {
      result_ = MotionRun(motion_).run(given_up_);
      ended_.store(true, std::memory_order_release);
    };
    if (!beside_loop) {
      work();
      return;
    }
    thread_ = guarded_thread(work, [this](const std::string& why) {
      result_ = Status::refused("the rehearsal has failed: " + why);
      ended_.store(true, std::memory_order_release);
    });
  }
  ~EngineRehearsal() override {
    given_up_ = true;
    if (thread_.joinable()) thread_.join();
  }
  EngineRehearsal(const EngineRehearsal&) = delete;
  EngineRehearsal& operator=(const EngineRehearsal&) = delete;

  std::optional<Status> outcome() override {
    if (!ended_.load(std::memory_order_acquire)) return std::nullopt;
    return result_;
  }

 private:
  RehearsedMotion motion_;
  Status result_;  // once it has ended
  std::atomic<bool> given_up_{false}, ended_{false};
  std::thread thread_;
};

// The joints as drives of the copy, which begin where the robot is.
bool place_robot(RehearsedMotion& motion, const GuardedPath& path, std::span<const double> present_q,
                 std::span<const double> v) {
  Instance robot = motion.engine->instance(motion.instance);
  for (const std::string& name : path.joints) {
    const int joint = robot.model().find_joint(name);
    if (joint < 0 || !robot.model().joints[static_cast<std::size_t>(joint)].scalar()) return false;
    motion.joints.push_back(joint);
  }
  const std::vector<double> q(present_q.begin(), present_q.end()), speed(v.begin(), v.end());
  robot.set_state(q, speed);
  for (const int joint : motion.joints) {
    const ServoParameters& servo = robot.made_of().servos[static_cast<std::size_t>(joint)];
    if (!servo.ideal) robot.set_servo(joint, servo);
    if (robot.drive(joint) != DriveMode::position) robot.set_drive(joint, DriveMode::position);
  }
  return !motion.joints.empty();
}

}  // namespace

std::unique_ptr<Rehearsal> Rehearser::begin(const Instance& robot, std::shared_ptr<const GuardScene> scene,
                                            const GuardedPath& path, Duration period) const {
  RehearsedMotion motion;
  motion.engine = robot.engine().clone();
  motion.instance = robot.index();
  motion.scene = std::move(scene);
  if (!place_robot(motion, path, present_q_(), robot.v())) return nullptr;
  motion.period = period * (1 + path.length / period / kMaxRows);
  const std::int64_t rows = path.length / motion.period + 1;
  std::vector<double> row(path.joints.size());
  for (std::int64_t i = 0; i <= rows; ++i) {
    if (!path.sample(std::min(motion.period * i, path.length), row)) continue;
    motion.rows.insert(motion.rows.end(), row.begin(), row.end());
  }
  if (motion.rows.empty()) return nullptr;
  return std::make_unique<EngineRehearsal>(std::move(motion), beside_loop_);
}

}  // namespace doppel
