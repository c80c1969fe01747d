// Inverse kinematics of arms beside other solvers (planning.md P6, P7): the same poses, the same judge, the
// same run.
//
//   bench_reach_peers [--poses N] [robot [name:=value ...] ...]
//
// robot: as for bench_reach. A pose is solved if one of the configurations is within 2e-5 m and rad of it,
// because peers that end at 1e-5 count each component, and within the limits, if need be after whole turns.
// Wrong: the solver reports a solution, and none is right.
// Times are those of the clock, because one peer uses two threads; the whole process's processor time beside
// them. Each block of poses is measured with every solver, so that all see the same load.
#include "reach_peers.h"

#include <fmt/format.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>

#include "doppel/robot/ik/ik_solver.h"
#include "reach_robots.h"

namespace {

using namespace doppel;
using namespace doppel::bench;

constexpr std::size_t kBlock = 250;    // poses
constexpr double kPeersJudged = 2e-5;  // m, rad

double process_us() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

class Ours : public IkPeer {
 public:
  explicit Ours(const IkSolver& solver, bool all) : solver_(solver), all_(all) {}

  [[nodiscard]] std::string name() const override {
    return all_ ? "doppel, all branches" : "doppel, " + solver_.about_method();
  }

  bool solve(const Pose& X_BT, const Eigen::VectorXd&, std::vector<Eigen::VectorXd>& out) override {
    IkRequest request;
    request.X_BT = X_BT;
    if (all_) {
      for (IkSolution& solution : solver_.solve_all(request)) out.push_back(std::move(solution.u));
    } else if (auto solution = solver_.solve(request)) {
      out.push_back(std::move(solution->u));
    }
    return !out.empty();
  }

 private:
  const IkSolver& solver_;
  bool all_;
};

struct PeerCounts {
  int solved = 0, wrong = 0;
  std::size_t solutions = 0;
  std::vector<double> us, process;
};

Eigen::VectorXd middle_of(const Chain& chain) {
  Eigen::VectorXd out(chain.size());
  for (int v = 0; v < chain.size(); ++v) {
    const bool limited = std::isfinite(chain.lower[v]) && std::isfinite(chain.upper[v]);
    out[v] = limited ? 0.5 * (chain.lower[v] + chain.upper[v]) : 0;
  }
  return out;
}

void measure(IkPeer& peer, std::span<const Pose> targets, const Eigen::VectorXd& seed, IkJudge& judge,
             PeerCounts& counts) {
  std::vector<Eigen::VectorXd> found;
  for (const Pose& X_BT : targets) {
    found.clear();
    const double process = process_us(), begin = clock_us();
    const bool any = peer.solve(X_BT, seed, found);
    counts.us.push_back(clock_us() - begin);
    counts.process.push_back(process_us() - process);
    int right = 0;
    for (Eigen::VectorXd& u : found) right += judge.right_by_turns(u, X_BT) ? 1 : 0;
    counts.solved += right > 0 ? 1 : 0;
    counts.wrong += right == 0 && any ? 1 : 0;
    counts.solutions += static_cast<std::size_t>(right);
  }
}

void compare(const RobotWord& word, const BenchRobot& robot, const ArmGroup& group, int poses) {
  const Chain& chain = group.chain;
  const IkSolver solver(robot.model, chain);
  IkPeers peers;
  std::vector<std::string> notes;
  peers.push_back(std::make_unique<Ours>(solver, false));
  peers.push_back(std::make_unique<Ours>(solver, true));
  add_kdl_peers(chain, peers, notes);
#ifdef DOPPEL_PEER_TRAC_IK
  add_trac_ik_peer(chain, peers, notes);
#endif
#ifdef DOPPEL_PEER_EAIK
  add_eaik_peer(chain, peers, notes);
#endif
  const ReachTargets targets = reachable_targets(*robot.model, chain, poses);
  const Eigen::VectorXd seed = middle_of(chain);
  IkJudge judge(*robot.model, chain, kPeersJudged);
  std::vector<PeerCounts> counts(peers.size());
  for (std::size_t first = 0; first < targets.X_BT.size(); first += kBlock) {
    const std::span<const Pose> block(targets.X_BT.data() + first,
                                      std::min(kBlock, targets.X_BT.size() - first));
    for (std::size_t i = 0; i < peers.size(); ++i) measure(*peers[i], block, seed, judge, counts[i]);
  }
  fmt::print("\n{}, {}: {} joints, {} poses\n", std::filesystem::path(word.robot).filename().string(),
             group.name, chain.size(), poses);
  fmt::print(
      "| solver | solved % | wrong | right ones a pose | p50 us | p95 us | processor p50 us | p50 ratio | "
      "p95 ratio |\n|---|---|---|---|---|---|---|---|---|\n");
  const double p50 = quantile(counts[0].us, 0.5), p95 = quantile(counts[0].us, 0.95);
  for (std::size_t i = 0; i < peers.size(); ++i) {
    PeerCounts& c = counts[i];
    fmt::print("| {} | {:.2f} | {} | {:.2f} | {:.1f} | {:.0f} | {:.1f} | {:.1f} | {:.1f} |\n",
               peers[i]->name(), 100.0 * c.solved / poses, c.wrong, static_cast<double>(c.solutions) / poses,
               quantile(c.us, 0.5), quantile(c.us, 0.95), quantile(c.process, 0.5), quantile(c.us, 0.5) / p50,
               quantile(c.us, 0.95) / p95);
  }
  for (const std::string& note : notes) fmt::print("{}\n", note);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  int poses = 10000;
  std::vector<std::string> words;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--poses" && i + 1 < argc) {
      poses = std::max(1, std::atoi(argv[++i]));
    } else {
      words.emplace_back(argv[i]);
    }
  }
  if (words.empty()) words = {"omarm_one", "omarm_zero", "lab_arm", "kate"};
  bool any_failed = false;
  for (const RobotWord& word : parse_robots(words)) {
    try {
      const BenchRobot robot = open_robot(word);
      for (const ArmGroup& group : robot.arms) compare(word, robot, group, poses);
    } catch (const std::exception& error) {
      fmt::print("\n{}: {}\n", word.shown(), error.what());
      any_failed = true;
    }
  }
  return any_failed ? EXIT_FAILURE : EXIT_SUCCESS;
}
