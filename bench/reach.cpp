// Inverse kinematics, reach maps and self-collision of arms (planning.md P6, P7, P10, P11, P14): how many of
// 10,000 reachable poses are solved and how long it takes, all branches, batches, whether the same request
// gives the same bits, the time between a file and an arm that is ready, maps, and the verdicts of collision
// against FCL's.
//
//   bench_reach [--map] [--sweep] [--table] [--poses N] [--states N] [robot [name:=value ...] ...]
//
// robot: a bundled robot, a file, or FILE:BASE:TIP. Without robots: the bundled ones. --table: one line of
// Markdown for each group, and nothing else. Times of solutions are those of the processor, others those of
// the clock. The caches are in a folder of their own, which is empty before each robot.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "doppel/base/core/plugin_module.h"
#include "doppel/robot/lanes/lane_program.h"
#include "doppel/robot/reach/reach_map.h"
#include "reach_robots.h"
#include "reach_sweep.h"

namespace {

using namespace doppel;
using namespace doppel::bench;

constexpr int kBranchPoses = 2000, kBatch = 1024, kBatchRounds = 5, kRepeats = 100, kKernelTargets = 256;
constexpr double kLateUs = 1000;
constexpr double kMapCell = 0.025;  // m
constexpr int kMapDirections = 50, kCoarseDirections = 8, kCoarseCells = 16;

struct Options {
  bool map = false, sweep = false, table = false;
  int poses = 10000, states = 1000;
  std::vector<RobotWord> robots;
};

struct SolveCounts {
  int poses = 0, solved = 0, wrong = 0, late = 0;
  double p50 = 0, p95 = 0, p99 = 0, longest = 0;  // us
  double all_p50 = 0, all_p95 = 0, branches = 0;
  double batch_per_second = 0;
  bool same_again = true, same_kernels = true;
  int kernels = 0;
};

// An arm that is ready to be asked: all that `doppel ik` and the checks of edges need.
struct ReadyArm {
  BenchRobot robot;
  std::shared_ptr<const CollisionScene> scene;
  std::shared_ptr<const InstanceCovers> covers;
  std::unique_ptr<ArmReach> reach;
  std::string problem;  // of the scene or the covers
  double ms = 0;        // of the clock, since the file
  double load_ms = 0, scene_ms = 0, solver_ms = 0, covers_ms = 0;
};

double ms_since(double& before) {
  const double now = clock_us(), out = (now - before) * 1e-3;
  before = now;
  return out;
}

ReadyArm make_ready(const RobotWord& word, std::size_t arm) {
  ReadyArm out;
  const double begin = clock_us();
  double step = begin;
  out.robot = open_robot(word);
  out.load_ms = ms_since(step);
  if (arm >= out.robot.arms.size()) return out;
  const Chain& chain = out.robot.arms[arm].chain;
  Diagnostics notes;
  out.scene = reach_scene(out.robot.description, out.robot.model, &chain, {}, notes);
  out.scene_ms = ms_since(step);
  out.reach = std::make_unique<ArmReach>(out.robot.model, chain, out.scene);
  out.solver_ms = ms_since(step);
  CoverOptions options;
  if (!notes.all().empty()) {
    out.problem = notes.all().front().message;
    options.detail = CollisionDetail::hulls;
  }
  try {
    out.covers = make_covers(out.scene->instances().front(), options);
  } catch (const InputError& error) {
    out.problem = error.what();
  }
  out.covers_ms = ms_since(step);
  out.ms = (clock_us() - begin) * 1e-3;
  return out;
}

// The results of a search from the middle of the limits, and the poses there, by the kernels of a module.
std::vector<double> kernel_results(const std::string& module, const Chain& chain,
                                   const std::vector<double>& targets, const std::vector<double>& starts) {
  const LaneKernels& kernels = lane_kernels(module.c_str());
  const LaneProgram program(chain);
  const int count = static_cast<int>(targets.size() / 12);
  const auto n = static_cast<std::size_t>(chain.size());
  std::vector<double> out(static_cast<std::size_t>(count) * (n + 12), 0.0);
  std::vector<int> attempts(static_cast<std::size_t>(count));
  LaneSearch search{};
  search.chain = &program.chain();
  search.task = IkTask::pose;
  search.targets = targets.data();
  search.target_count = count;
  search.starts = starts.data();
  search.start_count = static_cast<int>(starts.size() / n);
  search.max_iterations = 16;
  search.position_tolerance = search.rotation_tolerance = 1e-9;
  search.length = std::max(chain.length, 1e-6);
  search.rotation_weight = 1;
  search.q = out.data();
  search.attempt = attempts.data();
  kernels.search(search);
  for (std::size_t i = 0; i < attempts.size(); ++i) {
    if (attempts[i] < 0) std::fill_n(&out[i * n], n, 0.0);
  }
  kernels.tip_poses(program.chain(), out.data(), count, &out[static_cast<std::size_t>(count) * n]);
  out.insert(out.end(), attempts.begin(), attempts.end());
  return out;
}

void compare_kernels(const Chain& chain, const ReachTargets& targets, SolveCounts& out) {
  std::vector<double> numbers(kKernelTargets * 12), starts;
  for (std::size_t i = 0; i < kKernelTargets; ++i)
    to_numbers(targets.X_BT[i % targets.X_BT.size()], &numbers[i * 12]);
  for (int k = 0; k < 16; ++k) {
    for (int v = 0; v < chain.size(); ++v) {
      const double part = 0.5 + 0.45 * std::sin(1.0 + 3.0 * k + 7.0 * v);
      const double low = std::isfinite(chain.lower[v]) ? chain.lower[v] : -M_PI;
      const double high = std::isfinite(chain.upper[v]) ? chain.upper[v] : M_PI;
      starts.push_back(low + part * (high - low));
    }
  }
  static const std::vector<std::string> modules = modules_for_processor("doppel_lane_kernels");
  out.kernels = static_cast<int>(modules.size());
  const std::vector<double> first = kernel_results(modules.front(), chain, numbers, starts);
  for (const std::string& module : modules) {
    const std::vector<double> other = kernel_results(module, chain, numbers, starts);
    out.same_kernels =
        out.same_kernels && std::memcmp(first.data(), other.data(), first.size() * sizeof(double)) == 0;
  }
}

void measure_poses(const IkSolver& solver, const ReachTargets& targets, SolveCounts& out) {
  IkJudge judge(solver.model(), solver.chain());
  std::vector<double> us;
  IkRequest request;
  for (const Pose& X_BT : targets.X_BT) {
    request.X_BT = X_BT;
    const double begin = thread_us();
    const auto solution = solver.solve(request);
    us.push_back(thread_us() - begin);
    ++out.poses;
    out.late += us.back() > kLateUs ? 1 : 0;
    if (!solution) continue;
    const bool right = judge.right(solution->u, X_BT);
    out.solved += right && us.back() <= kLateUs ? 1 : 0;
    out.wrong += right ? 0 : 1;
  }
  out.p50 = quantile(us, 0.5);
  out.p95 = quantile(us, 0.95);
  out.p99 = quantile(us, 0.99);
  out.longest = quantile(us, 1);
}

void measure_branches(const IkSolver& solver, const ReachTargets& targets, SolveCounts& out) {
  IkJudge judge(solver.model(), solver.chain());
  std::vector<double> us;
  IkRequest request;
  std::size_t branches = 0;
  for (const Pose& X_BT : targets.X_BT) {
    if (us.size() == kBranchPoses) break;
    request.X_BT = X_BT;
    const double begin = thread_us();
    const auto all = solver.solve_all(request);
    us.push_back(thread_us() - begin);
    branches += all.size();
    for (const IkSolution& solution : all) out.wrong += judge.right(solution.u, X_BT) ? 0 : 1;
  }
  out.branches = static_cast<double>(branches) / static_cast<double>(us.size());
  out.all_p50 = quantile(us, 0.5);
  out.all_p95 = quantile(us, 0.95);
}

void measure_batch(const IkSolver& solver, const ReachTargets& targets, SolveCounts& out) {
  IkJudge judge(solver.model(), solver.chain());
  const std::span<const Pose> batch(targets.X_BT.data(), std::min<std::size_t>(kBatch, targets.X_BT.size()));
  std::vector<std::optional<Eigen::VectorXd>> found;
  double best = 0;
  for (int round = 0; round < kBatchRounds; ++round) {
    const double begin = thread_us();
    solver.solve_batch(batch, IkRequest{}, {}, found);
    const double us = thread_us() - begin;
    const auto solved =
        std::count_if(found.begin(), found.end(), [](const auto& u) { return u.has_value(); });
    best = std::max(best, static_cast<double>(solved) / us * 1e6);
  }
  for (std::size_t i = 0; i < found.size(); ++i) out.wrong += found[i] && !judge.right(*found[i], batch[i]);
  out.batch_per_second = best;
}

void repeat_request(const IkSolver& solver, const ReachTargets& targets, SolveCounts& out) {
  IkRequest request;
  request.X_BT = targets.X_BT.front();
  const auto first = solver.solve(request);
  for (int i = 1; i < kRepeats; ++i) {
    // Another request between two of the same must leave nothing behind.
    request.X_BT = targets.X_BT[static_cast<std::size_t>(i) % targets.X_BT.size()];
    static_cast<void>(solver.solve(request));
    request.X_BT = targets.X_BT.front();
    const auto again = solver.solve(request);
    const auto bytes = static_cast<std::size_t>(solver.chain().size()) * sizeof(double);
    const bool same = first.has_value() == again.has_value() &&
                      (!first || std::memcmp(first->u.data(), again->u.data(), bytes) == 0);
    out.same_again = out.same_again && same;
  }
}

SolveCounts measure_arm(const IkSolver& solver, int poses) {
  const ReachTargets targets = reachable_targets(solver.model(), solver.chain(), poses);
  SolveCounts out;
  measure_poses(solver, targets, out);
  measure_branches(solver, targets, out);
  measure_batch(solver, targets, out);
  repeat_request(solver, targets, out);
  compare_kernels(solver.chain(), targets, out);
  return out;
}

const char* yes_no(bool yes) {
  return yes ? "yes" : "no";
}

double map_seconds(const ReadyArm& arm, double cell, int directions) {
  ReachMapOptions options;
  options.cell = cell;
  options.directions = directions;
  double begin = clock_us();
  static_cast<void>(make_reach_map(arm.robot.model, arm.reach->solver().chain(), arm.scene, options));
  return ms_since(begin) * 1e-3;
}

std::string sweep_cells(const SweepCounts& counts) {
  return fmt::format("{:.1f} | {}/{}, {}/{}{}{}", 100.0 * counts.touching / std::max(1, counts.states),
                     counts.free_wrong, counts.touching_wrong, counts.covers_free_wrong,
                     counts.covers_touching_wrong, counts.first.empty() ? "" : ": ", counts.first);
}

class Bench {
 public:
  explicit Bench(Options options) : options_(std::move(options)) {}

  int run() {
    make_cache();
    if (options_.table) {
      fmt::print(
          "| robot | group | joints | freedom | method | ready first / again, ms | solved % | wrong | "
          "p50 us | p95 us | touching % | free/touching wrong by triangles, by covers |\n");
      fmt::print("|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    }
    bool any_failed = false;
    for (const RobotWord& word : options_.robots) {
      clear_cache();
      try {
        run_robot(word);
      } catch (const std::exception& error) {
        any_failed = true;
        report_failure(word, "-", error.what());
      }
      std::fflush(stdout);
    }
    std::filesystem::remove_all(cache_);
    return any_failed ? EXIT_FAILURE : EXIT_SUCCESS;
  }

 private:
  void make_cache() {
    std::string folder = (std::filesystem::temp_directory_path() / "bench_reach_XXXXXX").string();
    if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no folder for the caches");
    cache_ = folder;
    setenv("XDG_CACHE_HOME", folder.c_str(), 1);
  }

  void clear_cache() const {
    std::filesystem::remove_all(cache_);
    std::filesystem::create_directories(cache_);
  }

  void report_failure(const RobotWord& word, const std::string& group, std::string reason) const {
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    std::replace(reason.begin(), reason.end(), '|', '/');
    if (options_.table) {
      fmt::print("| {} | {} | - | - | {} | - | - | - | - | - | - | - |\n", shown(word), group, reason);
    } else {
      fmt::print("\n{}, {}: {}\n", shown(word), group, reason);
    }
  }

  // The file's name stands for the file.
  static std::string shown(RobotWord word) {
    word.robot = std::filesystem::path(word.robot).filename().string();
    return word.shown();
  }

  void run_robot(const RobotWord& word) {
    ReadyArm first = make_ready(word, 0);
    for (const Diagnostic& note : first.robot.no_arm.all()) report_failure(word, "-", note.message);
    if (first.robot.arms.empty() && first.robot.no_arm.all().empty())
      report_failure(word, "-", first.robot.groups == 0 ? "no group of joints" : "no arm");
    for (std::size_t i = 0; i < first.robot.arms.size(); ++i) {
      try {
        const ReadyArm arm = make_ready(word, i);
        run_arm(word, arm, arm.robot.arms[i], i == 0 ? &first : nullptr);
      } catch (const std::exception& error) {
        report_failure(word, first.robot.arms[i].name, error.what());
      }
      std::fflush(stdout);
    }
  }

  void run_arm(const RobotWord& word, const ReadyArm& arm, const ArmGroup& group, const ReadyArm* first) {
    const IkSolver& solver = arm.reach->solver();
    const SolveCounts counts = measure_arm(solver, options_.poses);
    std::string touching = "- | -", often;
    if (options_.sweep) {
      touching = arm.covers == nullptr || !arm.problem.empty() ? "- | " + arm.problem : judged(arm, often);
    }
    const double solved = 100.0 * counts.solved / counts.poses;
    if (options_.table) {
      const std::string ready = first != nullptr ? fmt::format("{:.0f}", first->ms) : "-";
      fmt::print("| {} | {} | {} | {} | {} | {} / {:.0f} | {:.2f} | {} | {:.1f} | {:.0f} | {} |\n",
                 shown(word), group.name, solver.chain().size(), solver.task_space().freedom,
                 solver.about_method(), ready, arm.ms, solved, counts.wrong, counts.p50, counts.p95,
                 touching);
      return;
    }
    fmt::print("\n{}, {}: {} joints, freedom {}, {}\n", shown(word), group.name, solver.chain().size(),
               solver.task_space().freedom, solver.about_method());
    fmt::print("  P6: {:.2f} % of {} solved within 1 ms, {} wrong, {} later\n", solved, counts.poses,
               counts.wrong, counts.late);
    fmt::print(
        "  P7: p50 {:.1f}, p95 {:.1f}, p99 {:.1f}, max {:.0f} us; all branches p50 {:.1f}, p95 {:.1f} "
        "us, {:.2f} in the mean; batch {:.0f} a second\n",
        counts.p50, counts.p95, counts.p99, counts.longest, counts.all_p50, counts.all_p95, counts.branches,
        counts.batch_per_second);
    fmt::print("  P14: same bits in {} runs: {}, by {} modules of kernels: {}\n", kRepeats,
               yes_no(counts.same_again), counts.kernels, yes_no(counts.same_kernels));
    if (first != nullptr) print_ready("first", *first);
    print_ready("again", arm);
    if (!arm.problem.empty()) fmt::print("  {}\n", arm.problem);
    if (options_.map) print_maps(arm);
    if (options_.sweep) {
      fmt::print("  {} states, touching % | free/touching wrong: {}; most often {}\n", options_.states,
                 touching, often);
    }
  }

  std::string judged(const ReadyArm& arm, std::string& often) const {
    try {
      const SweepCounts counts =
          sweep(arm.robot.description, arm.robot.model, *arm.reach, arm.scene, arm.covers, options_.states);
      often = counts.often;
      return sweep_cells(counts);
    } catch (const std::exception& error) {
      return fmt::format("- | {}", error.what());
    }
  }

  static void print_ready(const char* when, const ReadyArm& arm) {
    fmt::print("  P11: ready {} in {:.0f} ms: load {:.0f}, scene {:.0f}, solver {:.0f}, covers {:.0f}\n",
               when, arm.ms, arm.load_ms, arm.scene_ms, arm.solver_ms, arm.covers_ms);
  }

  static void print_maps(const ReadyArm& arm) {
    const double diameter = 2 * arm.reach->solver().chain().length;
    fmt::print("  P10: length {:.2f} m; first picture: {:.2f} s", diameter / 2,
               map_seconds(arm, diameter / kCoarseCells, kCoarseDirections));
    std::fflush(stdout);
    fmt::print("; cells of 25 mm, {} directions: {:.1f} s\n", kMapDirections,
               map_seconds(arm, kMapCell, kMapDirections));
    std::fflush(stdout);
  }

  Options options_;
  std::filesystem::path cache_;
};

Options parse(int argc, char** argv) {
  Options out;
  std::vector<std::string> robots;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--map") {
      out.map = true;
    } else if (word == "--sweep") {
      out.sweep = true;
    } else if (word == "--table") {
      out.table = true;
    } else if (word == "--poses" && i + 1 < argc) {
      out.poses = std::max(1, std::atoi(argv[++i]));
    } else if (word == "--states" && i + 1 < argc) {
      out.states = std::max(1, std::atoi(argv[++i]));
    } else {
      robots.push_back(word);
    }
  }
  if (robots.empty()) robots = {"omarm_one", "omarm_zero", "lab_arm", "kate"};
  out.robots = parse_robots(robots);
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Bench(parse(argc, argv)).run();
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return EXIT_FAILURE;
  }
}
