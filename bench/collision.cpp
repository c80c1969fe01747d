// Distances between the links of robots in random states, by CollisionScene and by FCL 0.7 side by
// side: the largest difference, the states that one calls touching and the other free, and the time of
// a state: of all pairs' distances by both (by FCL with both of its solvers, FclReference says why), of
// the nearest pair, and of the check for a collision by both.
//
//   bench_collision [states] [robot or file ...]
//
// Without robots: the bundled ones, and two of the corpus beside the repository, if it is there.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "doppel/robot/collision/test/fcl_reference.h"

namespace {

using namespace doppel;

constexpr std::uint64_t kSeed = 7;
constexpr double kAgreement = 1e-4;  // m

double computed_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

struct Comparison {
  std::size_t pairs = 0;       // of a state
  double difference = 0;       // m, the largest of two that are apart by FCL
  int apart = 0;               // pairs that differ by more than kAgreement
  int called_free = 0;         // states that FCL calls touching and doppel free
  int called_touching = 0;     // the reverse
  int touching = 0;            // states, by FCL
  double doppel = 0, fcl = 0;  // us of a state: all pairs
  double nearest = 0;          // us of a state: CollisionContext::distance()
  double check = 0;            // us of a state: in_collision()
  double fcl_check = 0;        // us of a state: fcl::collide() up to the first pair that touches
};

class Bench {
 public:
  Bench(const std::string& target, int states)
      : states_(states),
        robot_(test::load_colliding(target, DOPPEL_ROBOTS)),
        context_(robot_.scene),
        fcl_(robot_.scene->instances()[0].shapes),
        data_(*robot_.model) {}

  Comparison run() {
    std::mt19937_64 random(kSeed);
    const auto& pairs = robot_.scene->tested_pairs();
    out_.pairs = pairs.size();
    doppel_.resize(pairs.size());
    theirs_.resize(pairs.size());
    for (int state = 0; state < states_; ++state) compare(test::random_state(*robot_.model, random));
    for (double* time : {&out_.doppel, &out_.fcl, &out_.nearest, &out_.check, &out_.fcl_check})
      *time /= states_;
    return out_;
  }

 private:
  template <class Work>
  static void timed(double& sum, const Work& work) {
    const double begin = computed_us();
    work();
    sum += computed_us() - begin;
  }

  void compare(const Eigen::VectorXd& q) {
    const auto& pairs = robot_.scene->tested_pairs();
    bool touching = false, colliding = false;
    timed(out_.doppel, [&] {
      context_.set_configuration(0, q);
      for (std::size_t i = 0; i < pairs.size(); ++i)
        doppel_[i] = context_.distance(pairs[i].first, pairs[i].second).distance;
    });
    timed(out_.fcl, [&] {
      forward_kinematics(*robot_.model, data_, q);
      for (std::size_t i = 0; i < pairs.size(); ++i)
        theirs_[i] = fcl_.distance(pairs[i].first.link, pairs[i].second.link, data_.X_WL);
    });
    timed(out_.nearest, [&] {
      context_.set_configuration(0, q);
      static_cast<void>(context_.distance());
    });
    timed(out_.check, [&] {
      context_.set_configuration(0, q);
      colliding = context_.in_collision();
    });
    const auto touch = [&](const auto& pair) {
      return fcl_.touch(pair.first.link, pair.second.link, data_.X_WL);
    };
    timed(out_.fcl_check, [&] {
      forward_kinematics(*robot_.model, data_, q);
      touching = std::ranges::any_of(pairs, touch);
    });
    for (std::size_t i = 0; touching && i < pairs.size(); ++i) theirs_[i] = touch(pairs[i]) ? 0 : theirs_[i];
    out_.touching += touching ? 1 : 0;
    out_.called_free += touching && !colliding ? 1 : 0;
    out_.called_touching += colliding && !touching ? 1 : 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double difference = std::abs(std::max(doppel_[i], 0.0) - std::max(theirs_[i], 0.0));
      out_.difference = std::max(out_.difference, difference);
      out_.apart += difference > kAgreement ? 1 : 0;
    }
  }

  int states_;
  test::CollidingRobot robot_;
  CollisionContext context_;
  test::FclReference fcl_;
  Data data_;
  Comparison out_;
  std::vector<double> doppel_, theirs_;  // [pairs] m
};

std::vector<std::string> default_robots() {
  std::vector<std::string> out{"omarm_one", "omarm_zero", "lab_arm",       "kate",
                               "turtle",    "rover_skid", "rover_mecanum", "ackermann_car"};
  const std::filesystem::path corpus = std::filesystem::path(DOPPEL_ROBOTS) / "../../shared/corpus/robots";
  for (const char* file :
       {"fanuc/fanuc_m6ib_support/urdf/m6ib.xacro", "fanuc/fanuc_m6ib_support/urdf/m6ib6s.xacro"}) {
    if (std::filesystem::exists(corpus / file)) out.push_back((corpus / file).string());
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  const int states = argc > 1 ? std::atoi(argv[1]) : 10000;
  if (states < 1) {
    fmt::print(stderr, "usage: bench_collision [states] [robot or file ...]\n");
    return 2;
  }
  std::vector<std::string> robots(argv + std::min(argc, 2), argv + argc);
  if (robots.empty()) robots = default_robots();
  fmt::print("{} random states of each robot, seed {}; us are those of a state\n", states, kSeed);
  fmt::print("{:<16}{:>6} {:>13} {:>8} {:>9} {:>6} {:>9} {:>8} {:>8} {:>9} {:>8} {:>9}\n", "robot", "pairs",
             "difference/m", ">0.1 mm", "touching", "free!", "touching!", "doppel/us", "FCL/us", "nearest/us",
             "check/us", "FCL check");
  for (const std::string& robot : robots) {
    const Comparison c = Bench(robot, states).run();
    fmt::print("{:<16}{:>6} {:>13.1e} {:>8} {:>9} {:>6} {:>9} {:>8.1f} {:>8.1f} {:>9.1f} {:>8.1f} {:>9.1f}\n",
               std::filesystem::path(robot).stem().string(), c.pairs, c.difference, c.apart, c.touching,
               c.called_free, c.called_touching, c.doppel, c.fcl, c.nearest, c.check, c.fcl_check);
  }
}
