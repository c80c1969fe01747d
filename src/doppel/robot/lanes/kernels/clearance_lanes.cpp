// LaneClearance: poses and spheres in float, one configuration in each lane.
//
// Margin, with u = 2^-24 and a tree whose offsets from the root to a sphere have the sum R: a joint adds at
// most 40 u to the error of the rotation, as a norm: 12 u and 2 u by the product with X_PZ and its rounding,
// 20 u by the product with the joint's rotation, of which the sine and cosine are 4 u wrong. So behind n
// joints a centre is wrong by at most 40 n u R for the rotations, 5 n u R for the sums of origins, and 8 u R
// for its own sum; the squared distance of two centres, and of radii, adds 16 u R. clearance_error() is that
// and a little more. The caller has added it to the radii.
#include <cstring>

#include "doppel/robot/lanes/kernels/chain_lanes.h"
#include "doppel/robot/lanes/kernels/float_lanes.h"
#include "doppel/robot/lanes/kernels/kernels.h"

namespace {

using doppel::LaneBody;
using doppel::LaneClearance;
using doppel::LaneSolid;
using doppel::LaneSolidKind;
using doppel::LaneSphere;
using doppel::LaneTree;

template <int L>
struct FloatVector {
  Floats<L> x, y, z;
};

template <int L>
class ClearanceTest {
 public:
  DOPPEL_LANES explicit ClearanceTest(const LaneClearance& query) : query_(query), tree_(*query.tree) {
    auto* next = static_cast<char*>(query.memory);
    frames_ = reinterpret_cast<float*>(next);
    next += sizeof(float) * 12 * L * static_cast<std::size_t>(tree_.joint_count);
    groups_ = reinterpret_cast<float*>(next);
    next += sizeof(float) * 3 * L * static_cast<std::size_t>(tree_.group_count);
    bounds_ = reinterpret_cast<float*>(next);
    next += sizeof(float) * 3 * L * static_cast<std::size_t>(tree_.body_count);
    centres_ = reinterpret_cast<float*>(next);
    next += sizeof(float) * 3 * L * static_cast<std::size_t>(tree_.sphere_count);
    placed_ = next;
    all_ = query.count >= 32 ? ~0U : (1U << query.count) - 1;
  }

  DOPPEL_LANES std::uint32_t run() {
    for (int i = 0; i < tree_.joint_count; ++i) move_joint(i);
    for (int i = 0; i < tree_.group_count; ++i) {
      const doppel::LaneGroup& group = tree_.groups[i];
      if (group.joint >= 0) place(group.joint, group.bound, groups_ + i * 3 * L);
    }
    std::memset(placed_, 0, static_cast<std::size_t>(tree_.body_count * kFlags));
    std::memset(query_.touching, 0, sizeof(std::uint32_t) * static_cast<std::size_t>(tree_.pair_count));
    float spans[L] = {};
    if (query_.spans != nullptr) {
      for (int lane = 0; lane < query_.count; ++lane) spans[lane] = query_.spans[lane];
    }
    spans_ = load_floats<L>(spans);
    std::uint32_t touching = 0;
    constexpr int kRunsAtOnce = 4;
    for (int first = 0; first < tree_.run_count; first += kRunsAtOnce) {
      const int last = first + kRunsAtOnce < tree_.run_count ? first + kRunsAtOnce : tree_.run_count;
      // Most groups are apart: one branch for several of them.
      FloatMask<L> near = no_lanes<L>();
      for (int run = first; run < last; ++run) near = near | near_groups(tree_.runs[run]);
      if ((bits_of_floats(near) & all_) == 0) continue;
      for (int run = first; run < last; ++run) touching |= test_run(tree_.runs[run], touching);
      if (query_.until_decided && touching == all_) break;
    }
    return touching;
  }

 private:
  static constexpr int kGroups = L / kLanes;
  static constexpr float kEverywhere = 1e15F;              // m
  static constexpr int kFlags = doppel::kCoverLevels + 1;  // of a body: its levels, and its bound

  // The position of a joint in all lanes; those without a configuration repeat the last one.
  DOPPEL_LANES Lane position_in_group(const doppel::LaneJoint& joint, int group) const {
    double values[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) {
      const int state = group * kLanes + lane;
      const int repeated = state < query_.count ? state : query_.count - 1;
      values[lane] = query_.u[repeated * tree_.variable_count + joint.variable];
    }
    return load(values) * joint.multiplier + joint.offset;
  }

  DOPPEL_LANES Floats<L> column_of(const float* P, int k, const double* C, int column) const {
    return load_floats<L>(P + k * L) * static_cast<float>(C[column]) +
           load_floats<L>(P + (3 + k) * L) * static_cast<float>(C[3 + column]) +
           load_floats<L>(P + (6 + k) * L) * static_cast<float>(C[6 + column]);
  }

  DOPPEL_LANES void move_joint(int index) {
    const doppel::LaneTreeJoint& tree_joint = tree_.joints[index];
    const doppel::LaneJoint& joint = tree_joint.joint;
    const double* const C = joint.X_PZ;
    alignas(64) float quarters[L], rests[L];
    for (int group = 0; group < kGroups; ++group) {
      const Lane q = position_in_group(joint, group);
      if (joint.prismatic) {
        narrow(q, rests + group * kLanes);
      } else {
        reduce_angle(q, quarters + group * kLanes, rests + group * kLanes);
      }
    }
    const Floats<L> rest = load_floats<L>(rests);
    Floats<L> sine = all_floats<L>(0.0F), cosine = all_floats<L>(1.0F), travel = rest;
    if (!joint.prismatic) {
      sine_cosine(load_floats<L>(quarters), rest, sine, cosine);
      travel = all_floats<L>(0.0F);
    }
    float* const X = frames_ + index * 12 * L;
    const float* const P = frames_ + tree_joint.parent * 12 * L;
    for (int k = 0; k < 3; ++k) {
      Floats<L> x, y, z, p;
      if (tree_joint.parent < 0) {
        x = all_floats<L>(static_cast<float>(C[k * 3]));
        y = all_floats<L>(static_cast<float>(C[k * 3 + 1]));
        z = all_floats<L>(static_cast<float>(C[k * 3 + 2]));
        p = all_floats<L>(static_cast<float>(C[9 + k]));
      } else {
        x = column_of(P, k, C, 0);
        y = column_of(P, k, C, 1);
        z = column_of(P, k, C, 2);
        p = load_floats<L>(P + (9 + k) * L) + (load_floats<L>(P + k * L) * static_cast<float>(C[9]) +
                                               load_floats<L>(P + (3 + k) * L) * static_cast<float>(C[10]) +
                                               load_floats<L>(P + (6 + k) * L) * static_cast<float>(C[11]));
      }
      if (joint.prismatic) {
        store_floats(x, X + k * L);
        store_floats(y, X + (3 + k) * L);
      } else {
        store_floats(x * cosine + y * sine, X + k * L);
        store_floats(y * cosine - x * sine, X + (3 + k) * L);
      }
      store_floats(z, X + (6 + k) * L);
      store_floats(joint.prismatic ? p + z * travel : p, X + (9 + k) * L);
    }
  }

  DOPPEL_LANES void place(int joint, const LaneSphere& sphere, float* out) const {
    if (joint < 0) {
      store_floats(all_floats<L>(sphere.x), out);
      store_floats(all_floats<L>(sphere.y), out + L);
      store_floats(all_floats<L>(sphere.z), out + 2 * L);
      return;
    }
    const float* const X = frames_ + joint * 12 * L;
    for (int k = 0; k < 3; ++k) {
      Floats<L> sum = load_floats<L>(X + (9 + k) * L) + load_floats<L>(X + k * L) * sphere.x;
      sum = sum + load_floats<L>(X + (3 + k) * L) * sphere.y;
      sum = sum + load_floats<L>(X + (6 + k) * L) * sphere.z;
      store_floats(sum, out + k * L);
    }
  }

  DOPPEL_LANES FloatVector<L> at(const float* centre) const {
    return {load_floats<L>(centre), load_floats<L>(centre + L), load_floats<L>(centre + 2 * L)};
  }

  // The spheres of a level are placed when a pair needs them first.
  DOPPEL_LANES void place_level(int index, int level) {
    char& placed = placed_[index * kFlags + level];
    if (placed != 0) return;
    placed = 1;
    const LaneBody& body = tree_.bodies[index];
    for (int i = 0; i < body.count[level]; ++i) {
      const int sphere = body.first[level] + i;
      place(body.joint, tree_.spheres[sphere], centres_ + sphere * 3 * L);
    }
  }

  DOPPEL_LANES FloatMask<L> near_sphere(const FloatVector<L>& a, const FloatVector<L>& b, float radii) const {
    const Floats<L> x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
    const Floats<L> reach = extra_ + radii;
    return x * x + y * y + z * z <= reach * reach;
  }

  DOPPEL_LANES FloatMask<L> near_solid(const FloatVector<L>& a, float radius, const LaneSolid& solid) const {
    const Floats<L> none = all_floats<L>(0.0F);
    const Floats<L> reach = extra_ + (radius + solid.rounding);
    const Floats<L> x = a.x + -solid.centre[0], y = a.y + -solid.centre[1], z = a.z + -solid.centre[2];
    const float* const R = solid.axes;
    const Floats<L> w = x * R[6] + y * R[7] + z * R[8];
    if (solid.kind == LaneSolidKind::half_space) return w <= reach;
    const Floats<L> u = x * R[0] + y * R[1] + z * R[2];
    const Floats<L> v = x * R[3] + y * R[4] + z * R[5];
    const Floats<L> above = max_of(size_of_floats(w) + -solid.sizes[2], none);
    if (solid.kind == LaneSolidKind::cylinder) {
      const Floats<L> outside = max_of(root_of(u * u + v * v) + -solid.sizes[0], none);
      return outside * outside + above * above <= reach * reach;
    }
    const Floats<L> beside = max_of(size_of_floats(u) + -solid.sizes[0], none);
    const Floats<L> behind = max_of(size_of_floats(v) + -solid.sizes[1], none);
    return beside * beside + behind * behind + above * above <= reach * reach;
  }

  // The motion of a pair in the span, and its padding.
  DOPPEL_LANES Floats<L> extra_of(int index) const {
    Floats<L> extra = all_floats<L>(0.0F);
    if (query_.rates != nullptr) extra = spans_ * query_.rates[index];
    if (query_.paddings != nullptr) extra = extra + query_.paddings[index];
    return extra;
  }

  // The largest of a run's pairs.
  DOPPEL_LANES Floats<L> extra_of_run(const doppel::LaneRun& run) const {
    Floats<L> extra = extra_of(run.first);
    for (int pair = run.first + 1; pair < run.first + run.count; ++pair)
      extra = max_of(extra, extra_of(pair));
    return extra;
  }

  // A group without a bounding sphere is near.
  DOPPEL_LANES FloatMask<L> near_groups(const doppel::LaneRun& run) const {
    const doppel::LaneGroup &a = tree_.groups[run.a], &b = tree_.groups[run.b];
    const FloatVector<L> centre = at(groups_ + run.a * 3 * L);
    FloatVector<L> apart;
    if (b.joint < 0) {
      apart = {centre.x + -b.bound.x, centre.y + -b.bound.y, centre.z + -b.bound.z};
    } else {
      const FloatVector<L> other = at(groups_ + run.b * 3 * L);
      apart = {centre.x - other.x, centre.y - other.y, centre.z - other.z};
    }
    const float radii = b.bound.radius < 0 ? kEverywhere : a.bound.radius + b.bound.radius;
    const Floats<L> square = apart.x * apart.x + apart.y * apart.y + apart.z * apart.z;
    if (query_.rates == nullptr && query_.paddings == nullptr) return square <= all_floats<L>(radii * radii);
    const Floats<L> reach = extra_of_run(run) + radii;
    return square <= reach * reach;
  }

  // The lanes in which a pair of the run may touch.
  DOPPEL_LANES std::uint32_t test_run(const doppel::LaneRun& run, std::uint32_t touching) {
    const std::uint32_t near = bits_of_floats(near_groups(run)) & all_;
    std::uint32_t found = 0;
    if (near == 0) return found;
    for (int pair = run.first; pair < run.first + run.count; ++pair) {
      const std::uint32_t live = query_.until_decided ? near & ~(touching | found) : near;
      if (live == 0) break;
      query_.touching[pair] = test(pair, live & bits_of_floats(near_bounds(pair)));
      found |= query_.touching[pair];
    }
    return found;
  }

  DOPPEL_LANES const float* bound_of(int body) {
    float* const out = bounds_ + body * 3 * L;
    char& placed = placed_[body * kFlags + doppel::kCoverLevels];
    if (placed == 0) place(tree_.bodies[body].joint, tree_.bodies[body].bound, out);
    placed = 1;
    return out;
  }

  // A body without a bounding sphere is near.
  DOPPEL_LANES FloatMask<L> near_bounds(int index) {
    const doppel::LanePair& pair = tree_.pairs[index];
    const LaneSphere &a = tree_.bodies[pair.a].bound, &b = tree_.bodies[pair.b].bound;
    extra_ = extra_of(index);
    const float radii = b.radius < 0 ? kEverywhere : a.radius + b.radius;
    return near_sphere(at(bound_of(pair.a)), at(bound_of(pair.b)), radii);
  }

  DOPPEL_LANES std::uint32_t test(int index, std::uint32_t live) {
    const doppel::LanePair& pair = tree_.pairs[index];
    const LaneBody& b = tree_.bodies[pair.b];
    extra_ = extra_of(index);
    if (live == 0 || query_.levels == 0) return live;
    for (int level = 0; level < query_.levels && live != 0; ++level) {
      std::uint32_t found = 0;
      for (int i = 0; i < b.solid_count && found != live; ++i)
        found |= test_solid(pair.a, level, tree_.solids[b.first_solid + i], live & ~found);
      if (b.count[level] > 0 && found != live) found |= test_spheres(pair.a, pair.b, level, live & ~found);
      live = found;
    }
    return live;
  }

  DOPPEL_LANES std::uint32_t test_solid(int body, int level, const LaneSolid& solid, std::uint32_t live) {
    const LaneBody& a = tree_.bodies[body];
    live &= bits_of_floats(near_solid(at(bound_of(body)), a.bound.radius, solid));
    if (live == 0) return 0;
    place_level(body, level);
    std::uint32_t found = 0;
    for (int i = 0; i < a.count[level] && found != live; ++i) {
      const int sphere = a.first[level] + i;
      found |= live &
               bits_of_floats(near_solid(at(centres_ + sphere * 3 * L), tree_.spheres[sphere].radius, solid));
    }
    return found;
  }

  DOPPEL_LANES std::uint32_t test_spheres(int body_a, int body_b, int level, std::uint32_t live) {
    const LaneBody &a = tree_.bodies[body_a], &b = tree_.bodies[body_b];
    place_level(body_a, level);
    place_level(body_b, level);
    const FloatVector<L> bound = at(bound_of(body_b));
    std::uint32_t found = 0;
    for (int i = 0; i < a.count[level]; ++i) {
      const int first = a.first[level] + i;
      const FloatVector<L> centre = at(centres_ + first * 3 * L);
      const float radius = tree_.spheres[first].radius;
      if ((bits_of_floats(near_sphere(centre, bound, radius + b.bound.radius)) & live & ~found) == 0)
        continue;
      FloatMask<L> near = no_lanes<L>();
      for (int k = 0; k < b.count[level]; ++k) {
        const int second = b.first[level] + k;
        near =
            near | near_sphere(centre, at(centres_ + second * 3 * L), radius + tree_.spheres[second].radius);
      }
      found |= bits_of_floats(near) & live;
      if (found == live) break;
    }
    return found;
  }

  const LaneClearance& query_;
  const LaneTree& tree_;
  float* frames_;   // [joints][12][L] columns of the rotation, then the origin
  float* groups_;   // [groups][3][L]
  float* bounds_;   // [bodies][3][L]
  float* centres_;  // [spheres][3][L]
  char* placed_;    // [bodies][kFlags]
  std::uint32_t all_;
  Floats<L> spans_, extra_;
};

}  // namespace

namespace doppel {

std::uint32_t clearance_in_8_lanes(const LaneClearance& query) {
  return ClearanceTest<8>(query).run();
}

std::uint32_t clearance_in_16_lanes(const LaneClearance& query) {
  return ClearanceTest<16>(query).run();
}

}  // namespace doppel
