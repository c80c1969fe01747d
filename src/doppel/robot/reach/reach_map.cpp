#include "doppel/robot/reach/reach_map.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/parallel_work.h"
#include "doppel/description/meshes/convex_hull.h"
#include "doppel/robot/ik/chain_jacobian.h"

namespace doppel {
namespace {

constexpr double kDefaultCells = 40;
constexpr double kMaxCells = 2e7;  // 320 MB
// From the middle and from starting points; a pose that none of them reaches counts as out of reach.
constexpr int kMapAttempts = 15;
constexpr double kPositionPart = 0.02;  // of a cell

Eigen::Matrix3d tool_towards(const Eigen::Vector3d& tool_axis, const Eigen::Vector3d& direction) {
  return Eigen::Quaterniond::FromTwoVectors(tool_axis, direction).toRotationMatrix();
}

// One thread's part of a map: whole columns of cells along z, so that a cell's seeds never depend on the
// number of threads.
class Column {
 public:
  Column(const std::shared_ptr<const Model>& model, const Chain& chain,
         const std::shared_ptr<const CollisionScene>& scene, const ReachMapOptions& options, ReachMap& map)
      : reach_(model, chain, options.collisions ? scene : nullptr),
        map_(map),
        q_(options.q.size() == model->nq ? options.q : model->neutral()),
        X_BW_(reach_.base_pose(q_).inverse(Eigen::Isometry)) {
    const std::vector<Eigen::Vector3d> directions =
        options.approach ? std::vector{*options.approach} : even_directions(options.directions);
    for (const Eigen::Vector3d& direction : directions)
      rotations_.emplace_back(tool_towards(reach_.solver().task_space().tool_axis, direction));
    base_ = X_BW_.inverse(Eigen::Isometry) * chain.joints.front().X_PZ.translation();
    length_ = chain.length;
    // Half the angle between neighbours: each direction stands for a cap of the sphere of that radius.
    spacing_ = std::sqrt(4.0 / static_cast<double>(std::max(2, map.directions)));
  }

  void run(int x, int y) {
    seed_ = {};
    for (int z = 0; z < map_.nz; ++z) {
      const auto index = static_cast<std::size_t>(&map_.at(x, y, z) - map_.cells.data());
      map_.cells[index] = judge(map_.center(x, y, z));
    }
  }

 private:
  ReachCell judge(const Eigen::Vector3d& p_W) {
    ReachCell out;
    if ((p_W - base_).norm() > length_ + 1e-9) return out;
    IkRequest request;
    request.X_BT.translation() = X_BW_ * p_W;
    request.task = IkTask::position;
    request.attempts = kMapAttempts;
    request.seed = seed_;
    request.accepts = [this](const Eigen::VectorXd& u) { return accepts(u); };
    const auto position = reach_.solver().solve(request);
    if (!position) return out;
    out.in_reach = true;
    note(*position, out);
    seed_ = position->u;
    solve_directions(request, out);
    return out;
  }

  void solve_directions(IkRequest& request, ReachCell& out) {
    request.task = IkTask::axis;
    targets_.clear();
    Pose X_BT = Pose::Identity();
    X_BT.translation() = request.X_BT.translation();
    seeds_.clear();
    for (const Eigen::Matrix3d& R : rotations_) {
      X_BT.linear() = X_BW_.linear() * R;
      targets_.push_back(X_BT);
      seeds_.insert(seeds_.end(), seed_.begin(), seed_.end());
    }
    // An arm that cannot turn its tool freely meets no direction exactly: one counts that it comes nearest
    // to.
    if (reach_.solver().task_space().freedom < 6) {
      request.rotation_tolerance = spacing_;
      request.position_tolerance = kPositionPart * map_.cell;
    }
    reach_.solver().solve_batch(targets_, request, seeds_, found_);
    int solved = 0;
    for (std::size_t i = 0; i < targets_.size(); ++i) {
      if (!found_[i]) continue;
      request.X_BT = targets_[i];
      if (accepts(*found_[i])) {
        ++solved;
        note(reach_.solver().measured(request, *found_[i]), out);
      } else if (const auto other = reach_.solver().solve(request)) {
        ++solved;
        note(*other, out);
      }
    }
    out.share = static_cast<float>(solved) / static_cast<float>(rotations_.size());
  }

  bool accepts(const Eigen::VectorXd& u) {
    reach_.solver().chain().apply(reach_.solver().model(), u, q_);
    return reach_.is_free(q_);
  }

  void note(const IkSolution& solution, ReachCell& out) {
    const Chain& chain = reach_.solver().chain();
    const int freedom = reach_.solver().task_space().freedom;
    out.limit_distance = std::max(out.limit_distance, static_cast<float>(limit_distance(chain, solution.u)));
    out.manipulability =
        std::max(out.manipulability, static_cast<float>(manipulability(chain, solution.u, freedom)));
  }

  ArmReach reach_;
  ReachMap& map_;
  Eigen::VectorXd q_, seed_;
  Pose X_BW_;
  Eigen::Vector3d base_;
  double length_ = 0, spacing_ = 0;
  std::vector<Eigen::Matrix3d> rotations_;
  std::vector<Pose> targets_;
  std::vector<double> seeds_;
  std::vector<std::optional<Eigen::VectorXd>> found_;
};

// A box of cells around everything that the chain's length can reach, with a cell at its centre.
ReachMap empty_map(const Chain& chain, const Eigen::Vector3d& center, const ReachMapOptions& options) {
  ReachMap out;
  const double reach = std::max(chain.length, 1e-3);
  out.cell = options.cell > 0 ? options.cell : 2 * reach / kDefaultCells;
  const double across = 2 * std::ceil(reach / out.cell) + 1;
  if (!(across * across * across <= kMaxCells)) {
    throw InputError(
        "reach.cells", {},
        fmt::format("cells of {:.3g} mm are too many for a reach of {:.3g} m", out.cell * 1e3, reach),
        fmt::format("use cells of at least {:.2g} m", 2.05 * reach / std::cbrt(kMaxCells)));
  }
  const int half = (static_cast<int>(across) - 1) / 2;
  out.nx = out.ny = out.nz = 2 * half + 1;
  out.origin = center - Eigen::Vector3d::Constant(half * out.cell);
  out.directions = options.approach ? 1 : options.directions;
  out.cells.resize(static_cast<std::size_t>(out.nx) * static_cast<std::size_t>(out.ny) *
                   static_cast<std::size_t>(out.nz));
  return out;
}

}  // namespace

ReachMap make_reach_map(const std::shared_ptr<const Model>& model, const Chain& chain,
                        const std::shared_ptr<const CollisionScene>& scene, const ReachMapOptions& options) {
  ArmReach probe(model, chain, nullptr);
  const Pose X_WB = probe.base_pose(options.q.size() == model->nq ? options.q : model->neutral());
  ReachMap map = empty_map(chain, X_WB * chain.joints.front().X_PZ.translation(), options);
  const int columns = map.nx * map.ny;
  const int threads = options.threads > 0
                          ? options.threads
                          : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::atomic<int> done{0};
  std::atomic<bool> cancelled{false};
  std::mutex reporting;
  parallel_work(static_cast<std::size_t>(columns), static_cast<std::size_t>(threads), [&] {
    return [&, column = std::make_shared<Column>(model, chain, scene, options, map)](std::size_t index) {
      if (cancelled) return;
      const auto i = static_cast<int>(index);
      column->run(i % map.nx, i / map.nx);
      const int finished = ++done;
      if (!options.progress || finished % 16 != 0) return;
      const std::lock_guard lock(reporting);
      if (!options.progress(static_cast<double>(finished) / columns)) cancelled = true;
    };
  });
  if (options.progress && !cancelled) options.progress(1);
  map.cancelled = cancelled;
  return map;
}

ReachFacts reach_facts(const ReachMap& map, const Eigen::Vector3d& first_joint) {
  ReachFacts out;
  const double cell_volume = map.cell * map.cell * map.cell;
  bool any = false;
  double best = -1;
  for (int z = 0; z < map.nz; ++z) {
    for (int y = 0; y < map.ny; ++y) {
      for (int x = 0; x < map.nx; ++x) {
        const ReachCell& cell = map.at(x, y, z);
        if (!cell.in_reach) continue;
        const Eigen::Vector3d p = map.center(x, y, z);
        out.low = any ? Eigen::Vector3d(out.low.cwiseMin(p)) : p;
        out.high = any ? Eigen::Vector3d(out.high.cwiseMax(p)) : p;
        any = true;
        out.volume += cell_volume;
        if (cell.share >= 0.9F) out.dexterous_volume += cell_volume;
        out.farthest = std::max(out.farthest, (p - first_joint).norm());
        const double score = cell.share + 1e-3 * cell.manipulability;
        if (score <= best) continue;
        best = score;
        out.best = p;
        out.best_share = cell.share;
      }
    }
  }
  return out;
}

}  // namespace doppel
