// LaneSearch: damped least squares, one attempt in each lane.
#include "doppel/robot/lanes/kernels/chain_lanes.h"
#include "doppel/robot/lanes/kernels/kernels.h"

namespace {

using doppel::IkTask;
using doppel::LaneChain;
using doppel::LaneSearch;

constexpr double kMaxStep = 0.9;         // rad or m, of one variable in one iteration
constexpr double kDamping = 0.02;        // times the squared residual
constexpr double kDampingFloor = 1e-14;  // keeps the equations solvable where joints are redundant
// The residual of the search for the nearest pose does not vanish: its damping follows success and failure.
constexpr double kFirstDamping = 1e-3, kMinDamping = 1e-10, kMaxDamping = 1e4;
constexpr double kAtRest = 1e-8;  // rad or m, of the longest step of a variable

// Which target and attempt a lane works on.
struct Work {
  int target = -1;  // none: the lane is idle
  int attempt = 0, iterations = 0;
};

// The targets' attempts in a fixed order: first one for each target, then further ones for the
// targets that are not solved, the next target first.
class Queue {
 public:
  explicit Queue(const LaneSearch& search)
      : search_(search), attempts_(search.start_count + (search.seeds != nullptr ? 1 : 0)) {
    const int results = search.target_count * (search.every_attempt ? attempts_ : 1);
    for (int i = 0; i < results; ++i) search.attempt[i] = -1;
  }

  [[nodiscard]] int slot(const Work& work) const {
    return search_.every_attempt ? work.target * attempts_ + work.attempt : work.target;
  }
  [[nodiscard]] bool solved(int target) const {
    return !search_.every_attempt && search_.attempt[target] >= 0;
  }

  // The next attempt; false: there is none.
  bool take(Work& work) {
    while (round_ < attempts_) {
      if (next_ == search_.target_count) {
        next_ = 0;
        ++round_;
        continue;
      }
      const int target = next_++;
      if (solved(target)) continue;
      work = {target, round_, 0};
      return true;
    }
    work.target = -1;
    return false;
  }

  [[nodiscard]] const double* start(const Work& work) const {
    const int n = search_.chain->variable_count;
    if (search_.seeds == nullptr) return search_.starts + work.attempt * n;
    return work.attempt == 0 ? search_.seeds + work.target * n : search_.starts + (work.attempt - 1) * n;
  }

 private:
  const LaneSearch& search_;
  const int attempts_;
  int round_ = 0, next_ = 0;
};

// A number of each lane, which is set for one lane at a time.
struct Slots {
  alignas(64) double value[kLanes];
};
DOPPEL_LANES double lane_of(const Lane& value, int lane) {
  double values[kLanes];
  store(value, values);
  return values[lane];
}

DOPPEL_LANES Lane3 broadcast3(const double* v) {
  return {broadcast(v[0]), broadcast(v[1]), broadcast(v[2])};
}

// The rotation that is left, as a vector in the base (2 sin(angle/2) times its axis), and the part of a
// joint's rotation that counts for the task: all of it, or its part across or along `direction`.
struct RotationError {
  Lane3 e;
  Lane3 direction;  // unit; task axis: the free axis; task angle: the only one that counts
  Mask opposite;    // more than a quarter turn is left, where the vector may vanish
};

DOPPEL_LANES Lane3 rotated(const LanePose& X, const Lane3& v) {
  return X.x * v.x + X.y * v.y + X.z * v.z;
}

DOPPEL_LANES RotationError rotation_error(const LaneSearch& search, const LanePose& X,
                                          const LanePose& target) {
  const Lane tiny = broadcast(1e-12);
  RotationError out{};
  if (search.task == IkTask::pose) {
    // The antisymmetric part of R_target R^T is the sum of cross products of the columns.
    const Lane3 twice_sine = cross(X.x, target.x) + cross(X.y, target.y) + cross(X.z, target.z);
    const Lane trace = dot(X.x, target.x) + dot(X.y, target.y) + dot(X.z, target.z);
    const Lane squared_cosine = larger((trace + 1.0) * 0.25, tiny);  // of half the angle
    out.e = twice_sine * (broadcast(0.5) / root(squared_cosine));
    out.opposite = trace < broadcast(1.0);
    return out;
  }
  const Lane3 tool = broadcast3(search.tool_axis);
  const Lane3 a = rotated(X, tool), a_target = rotated(target, tool);
  if (search.task == IkTask::axis) {
    const Lane cosine = dot(a, a_target);
    out.e = cross(a, a_target) * (broadcast(1.0) / root(larger((cosine + 1.0) * 0.5, tiny)));
    out.direction = a;
    out.opposite = cosine < broadcast(0.0);
    return out;
  }
  if (search.task == IkTask::angle) {
    const Lane3 reference = broadcast3(search.reference_axis);
    const Lane3 normal = cross(reference, a), target_normal = cross(reference, a_target);
    const Lane sine = root(dot(normal, normal)), target_sine = root(dot(target_normal, target_normal));
    const Lane cosine = dot(reference, a), target_cosine = dot(reference, a_target);
    // The sine of the difference of the two angles, whose way may be either.
    const Lane difference = target_sine * cosine - target_cosine * sine;
    const Lane same = target_cosine * cosine + target_sine * sine;
    out.direction = normal * (broadcast(1.0) / larger(sine, tiny));
    out.e = out.direction * (difference / root(larger((same + 1.0) * 0.5, tiny)));
    out.opposite = same < broadcast(0.0);
  }
  return out;
}

DOPPEL_LANES Lane3 counted(const LaneSearch& search, const RotationError& error, const Lane3& z) {
  if (search.task == IkTask::axis) return z - error.direction * dot(error.direction, z);
  if (search.task == IkTask::angle) return error.direction * dot(error.direction, z);
  return z;
}

// The numbers of the best configuration that a lane has seen, for the search for the nearest pose.
template <int kMax>
struct Best {
  Lane squared, position, rotation, damping;
  Lane u[kMax], g[kMax], A[kMax][kMax];
};

// All lanes of a search in a chain of N variables; 0: any number.
template <int N>
class Searcher {
 public:
  explicit Searcher(const LaneSearch& search)
      : search_(search), chain_(*search.chain), queue_(search), n_(search.chain->variable_count) {
    for (Slots& number : start_) number = {};
    for (Slots& number : goal_) number = {};
    for (int lane = 0; lane < kLanes; ++lane) next(lane);
    started_ = 0xFF;  // idle lanes start at zero
  }

  long run() {
    long iterations = 0;
    while (active_ != 0) {
      if (started_ != 0) begin();
      if (search_.nearest) {
        approach();
      } else {
        iterate();
      }
      ++iterations;
      finish();
    }
    return iterations;
  }

 private:
  static constexpr int kMax = N == 0 ? kMaxChainVariables : N;
  DOPPEL_LANES int variables() const { return N == 0 ? n_ : N; }

  // The tip and the columns of the Jacobian, weighted as the residual is.
  DOPPEL_LANES void differentiate() {
    LaneAxis axes[N == 0 ? kMaxChainJoints : N];
    X_ = identity_pose();
    const int joints = N == 0 ? chain_.joint_count : N;
    for (int i = 0; i < joints; ++i) {
      const doppel::LaneJoint& joint = chain_.joints[i];
      axes[i] = move_by(joint, N == 0 ? position_of(joint, u_) : u_[i], X_);
    }
    X_ = times(X_, chain_.X_ZT);
    error_ = rotation_error(search_, X_, target_);
    e_p_ = target_.p - X_.p;
    const double per_length = 1.0 / search_.length, weight = search_.rotation_weight;
    const Lane scale = broadcast(per_length);
    if constexpr (N == 0) {
      for (int v = 0; v < n_; ++v) linear_[v] = angular_[v] = Lane3{broadcast(0), broadcast(0), broadcast(0)};
    }
    for (int i = 0; i < joints; ++i) {
      const doppel::LaneJoint& joint = chain_.joints[i];
      Lane3 linear = axes[i].z * scale, angular{broadcast(0), broadcast(0), broadcast(0)};
      if (!joint.prismatic) {
        linear = cross(linear, X_.p - axes[i].p);
        if (search_.task != IkTask::position)
          angular = counted(search_, error_, axes[i].z) * broadcast(weight);
      }
      if constexpr (N == 0) {
        const Lane multiplier = broadcast(joint.multiplier);
        linear_[joint.variable] = linear_[joint.variable] + linear * multiplier;
        angular_[joint.variable] = angular_[joint.variable] + angular * multiplier;
      } else {
        linear_[i] = linear;
        angular_[i] = angular;
      }
    }
    r_p_ = e_p_ * scale;
    r_r_ = error_.e * broadcast(weight);
    squared_ = dot(r_p_, r_p_) + dot(r_r_, r_r_);
  }

  // The normal equations A, g; what is held at a limit has no column.
  DOPPEL_LANES void assemble() {
    const Lane zero = broadcast(0);
    for (int v = 0; v < variables(); ++v) {
      const Lane gradient = dot(linear_[v], r_p_) + dot(angular_[v], r_r_);
      const Mask low = (u_[v] <= broadcast(chain_.lower[v])) & (gradient < zero);
      const Mask high = (broadcast(chain_.upper[v]) <= u_[v]) & (zero < gradient);
      const Lane3 none{zero, zero, zero};
      const Mask held = low | high;
      linear_[v] = select(held, none, linear_[v]);
      angular_[v] = select(held, none, angular_[v]);
      g_[v] = select(held, zero, gradient);
      for (int k = 0; k <= v; ++k) A_[v][k] = dot(linear_[v], linear_[k]) + dot(angular_[v], angular_[k]);
    }
  }

  // (A + damping) step = g by Cholesky's method without roots.
  DOPPEL_LANES void solve(const Lane& damping) {
    Lane L[kMax][kMax], inverse[kMax];
    for (int v = 0; v < variables(); ++v) {
      for (int k = 0; k < v; ++k) {
        Lane sum = A_[v][k];
        for (int m = 0; m < k; ++m) sum = sum - L[v][m] * L[k][m] * inverse[m];
        L[v][k] = sum;
      }
      Lane pivot = A_[v][v] + damping;
      for (int m = 0; m < v; ++m) pivot = pivot - L[v][m] * L[v][m] * inverse[m];
      inverse[v] = broadcast(1.0) / larger(pivot, damping);
    }
    for (int v = 0; v < variables(); ++v) {
      Lane sum = g_[v];
      for (int m = 0; m < v; ++m) sum = sum - L[v][m] * step_[m];
      step_[v] = sum * inverse[v];
    }
    for (int v = variables() - 1; v >= 0; --v) {
      Lane sum = step_[v];
      for (int m = v + 1; m < variables(); ++m) sum = sum - L[m][v] * inverse[v] * step_[m];
      step_[v] = sum;
    }
  }

  DOPPEL_LANES void move() {
    Lane longest = broadcast(kMaxStep);
    for (int v = 0; v < variables(); ++v) longest = larger(longest, magnitude(step_[v]));
    const Lane shorten = broadcast(kMaxStep) / longest;
    moved_ = broadcast(0);
    for (int v = 0; v < variables(); ++v) {
      const Lane before = u_[v];
      u_[v] = smaller(larger(before + step_[v] * shorten, broadcast(chain_.lower[v])),
                      broadcast(chain_.upper[v]));
      moved_ = larger(moved_, magnitude(u_[v] - before));
    }
  }

  DOPPEL_LANES void iterate() {
    differentiate();
    const Lane position = dot(e_p_, e_p_), rotation = dot(error_.e, error_.e);
    const double p = search_.position_tolerance, r = search_.rotation_tolerance;
    Mask close = (position <= broadcast(p * p)) & (rotation <= broadcast(r * r));
    if (search_.task != IkTask::position) {
      close = close & ~error_.opposite;
    }
    converged_ = bits_of(close) & active_;
    for (int v = 0; v < variables(); ++v) found_u_[v] = u_[v];
    if (converged_ == active_) return;
    assemble();
    solve(squared_ * kDamping + kDampingFloor);
    move();
  }

  // One iteration of the search for the nearest pose: a step that makes the residual larger is taken back,
  // and tried again with more damping.
  DOPPEL_LANES void approach() {
    differentiate();
    const Lane position = dot(e_p_, e_p_), rotation = dot(error_.e, error_.e);
    assemble();
    const Mask better = squared_ < best_.squared;
    best_.squared = select(better, squared_, best_.squared);
    best_.position = select(better, position, best_.position);
    best_.rotation = select(better, rotation, best_.rotation);
    for (int v = 0; v < variables(); ++v) {
      best_.u[v] = u_[v] = select(better, u_[v], best_.u[v]);
      best_.g[v] = g_[v] = select(better, g_[v], best_.g[v]);
      for (int k = 0; k <= v; ++k) best_.A[v][k] = A_[v][k] = select(better, A_[v][k], best_.A[v][k]);
    }
    const Lane damping = best_.damping * select(better, broadcast(0.2), broadcast(5.0));
    best_.damping = larger(damping, broadcast(kMinDamping));
    solve(best_.damping);
    move();
    const Mask rest = (moved_ < broadcast(kAtRest)) | (broadcast(kMaxDamping) < best_.damping);
    converged_ = bits_of(rest) & active_;
    for (int v = 0; v < variables(); ++v) found_u_[v] = best_.u[v];
  }

  // Lanes that have converged or are at their last iteration get their next attempt; so do those of targets
  // that another lane has solved.
  void finish() {
    for (int lane = 0; lane < kLanes; ++lane) {
      if ((active_ & 1U << lane) == 0) continue;
      Work& work = work_[lane];
      ++work.iterations;
      const bool last = work.iterations >= search_.max_iterations;
      const bool done = (converged_ & 1U << lane) != 0 || (search_.nearest && last);
      if (done) record(lane);
      if (done || last || queue_.solved(work.target)) next(lane);
    }
  }

  void record(int lane) {
    const Work& work = work_[lane];
    if (queue_.solved(work.target)) return;
    const int slot = queue_.slot(work);
    search_.attempt[slot] = work.attempt;
    for (int v = 0; v < variables(); ++v) search_.q[slot * variables() + v] = lane_of(found_u_[v], lane);
    if (!search_.nearest) return;
    search_.residuals[slot * 2] = lane_of(root(best_.position), lane);
    search_.residuals[slot * 2 + 1] = lane_of(root(best_.rotation), lane);
  }

  void next(int lane) {
    if (!queue_.take(work_[lane])) {
      active_ &= ~(1U << lane);
      return;
    }
    active_ |= 1U << lane;
    const double* start = queue_.start(work_[lane]);
    for (int v = 0; v < variables(); ++v) start_[v].value[lane] = start[v];
    const double* X = search_.targets + work_[lane].target * 12;
    for (int k = 0; k < 12; ++k) goal_[k].value[lane] = X[k];
    started_ |= 1U << lane;
  }

  // Loads what next() has set. Lanes that go on keep their configuration.
  DOPPEL_LANES void begin() {
    Mask fresh;
    std::int64_t lanes[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) lanes[lane] = (started_ & 1U << lane) != 0 ? -1 : 0;
    std::memcpy(&fresh, lanes, sizeof fresh);
    for (int v = 0; v < variables(); ++v) {
      const Lane start = load(start_[v].value);
      u_[v] = started_ == 0xFF ? start : select(fresh, start, u_[v]);
    }
    const PoseNumbers numbers = numbers_of(target_);
    for (int k = 0; k < 12; ++k) *numbers.number[k] = load(goal_[k].value);
    if (search_.nearest) {
      const bool all = started_ == 0xFF;
      best_.squared = all ? broadcast(1e300) : select(fresh, broadcast(1e300), best_.squared);
      best_.damping =
          all ? broadcast(5 * kFirstDamping) : select(fresh, broadcast(5 * kFirstDamping), best_.damping);
    }
    started_ = 0;
  }

  const LaneSearch& search_;
  const LaneChain& chain_;
  Queue queue_;
  const int n_;
  unsigned active_ = 0, converged_ = 0, started_ = 0;  // a bit for each lane
  Slots start_[kMax], goal_[12];
  Work work_[kLanes];
  LanePose target_, X_;
  RotationError error_;
  Lane3 e_p_, r_p_, r_r_;
  Lane squared_, moved_;
  Best<kMax> best_;
  Lane u_[kMax], found_u_[kMax], step_[kMax], g_[kMax], A_[kMax][kMax];
  Lane3 linear_[kMax], angular_[kMax];
};

}  // namespace

namespace doppel {

long search_lanes(const LaneSearch& search) {
  const LaneChain& chain = *search.chain;
  if (chain.direct) {
    switch (chain.variable_count) {
      case 3:
        return Searcher<3>(search).run();
      case 4:
        return Searcher<4>(search).run();
      case 5:
        return Searcher<5>(search).run();
      case 6:
        return Searcher<6>(search).run();
      case 7:
        return Searcher<7>(search).run();
      default:
        break;
    }
  }
  return Searcher<0>(search).run();
}

}  // namespace doppel
