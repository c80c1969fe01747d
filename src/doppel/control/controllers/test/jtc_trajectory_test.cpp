// The polynomials of trajectories and how they are sampled, against closed forms and finite differences.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "doppel/control/controllers/detail/trajectory.h"

namespace doppel::jtc {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using Values = std::vector<double>;
constexpr double kPi = std::numbers::pi;
const std::vector<bool> kNoWraps;

struct Point {
  double time;
  Values p, v, a, effort;
};

Trajectory make(const std::vector<Point>& points, std::size_t joints = 1, double stamp = 0) {
  Trajectory trajectory(joints, points.size());
  trajectory.set_stamp(time_from_seconds(stamp));
  for (std::size_t i = 0; i < points.size(); ++i) {
    trajectory.add_point(from_seconds(points[i].time));
    const auto fill = [&](Field field, const Values& values) {
      if (!values.empty()) std::copy(values.begin(), values.end(), trajectory.give(i, field).begin());
    };
    fill(Field::positions, points[i].p);
    fill(Field::velocities, points[i].v);
    fill(Field::accelerations, points[i].a);
    fill(Field::effort, points[i].effort);
  }
  return trajectory;
}

JointStates state(Values p, Values v = {}, Values a = {}) {
  JointStates out(p.size());
  out.positions = std::move(p);
  out.has_velocities = !v.empty();
  out.has_accelerations = !a.empty();
  if (out.has_velocities) out.velocities = std::move(v);
  if (out.has_accelerations) out.accelerations = std::move(a);
  return out;
}

JointStates at(const Trajectory& trajectory, double time, Interpolation method = Interpolation::splines) {
  JointStates out(trajectory.joints());
  EXPECT_TRUE(trajectory.sample(time_from_seconds(time), method, out)) << "expected a sample at " << time;
  return out;
}

// jtc.md, B28.
TEST(JtcTrajectory, SinglePointStartsFromStateBefore) {
  Trajectory t = make({{2, {4}, {}, {}, {}}});
  t.begin(time_from_seconds(10), time_from_seconds(10), state({2}), kNoWraps);
  EXPECT_DOUBLE_EQ(at(t, 10).positions[0], 2);
  EXPECT_DOUBLE_EQ(at(t, 11).positions[0], 3);
  EXPECT_DOUBLE_EQ(at(t, 12).positions[0], 4);
  EXPECT_EQ(t.start_time(), time_from_seconds(10));
  EXPECT_EQ(t.end_time(), time_from_seconds(12));
}

// jtc.md, B30.
TEST(JtcTrajectory, PositionsAreInterpolatedLinearly) {
  Trajectory t = make({{1, {1, -1}, {}, {}, {}}, {3, {5, 0}, {}, {}, {}}}, 2);
  t.begin(Time{}, Time{}, state({0, 0}, {9, 9}), kNoWraps);  // a measured velocity does not raise the degree
  EXPECT_THAT(at(t, 0.5).positions, ElementsAre(0.5, -0.5));
  EXPECT_THAT(at(t, 0.5).velocities, ElementsAre(1, -1));
  EXPECT_THAT(at(t, 2).positions, ElementsAre(3, -0.5));
  EXPECT_THAT(at(t, 2).velocities, ElementsAre(2, 0.5));
  EXPECT_THAT(at(t, 2).accelerations, ElementsAre(0, 0));
}

// jtc.md, B30.
TEST(JtcTrajectory, CubicAndQuinticMeetBoundaries) {
  const unsigned seed = 32;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-3, 3), duration(0.1, 4);
  for (int run = 0; run < 2000; ++run) {
    const bool quintic = run % 2 == 0;
    const auto one = [&] { return Values{value(random)}; };
    const Point a{duration(random), one(), one(), quintic ? one() : Values{}, {}};
    const Point b{a.time + duration(random), one(), one(), quintic ? one() : Values{}, {}};
    Trajectory t = make({a, b});
    t.begin(Time{}, Time{}, state(one(), one(), one()), kNoWraps);
    const Point* const ends[] = {&a, &b};
    for (const Point* end : ends) {
      // Just before the point, so that the polynomial is sampled and not the point itself.
      const JointStates s = at(t, end->time - 1e-9);
      EXPECT_NEAR(s.positions[0], end->p[0], 1e-6);
      EXPECT_NEAR(s.velocities[0], end->v[0], 1e-4);
      if (quintic) {
        EXPECT_NEAR(s.accelerations[0], end->a[0], 1e-2);
      }
    }
    const JointStates s = at(t, a.time);
    EXPECT_NEAR(s.positions[0], a.p[0], 1e-12);
    EXPECT_NEAR(s.velocities[0], a.v[0], 1e-12);
    if (quintic) {
      EXPECT_NEAR(s.accelerations[0], a.a[0], 1e-12);
    }
  }
}

// jtc.md, B30.
TEST(JtcTrajectory, VelocityAndAccelerationAreDerivatives) {
  const unsigned seed = 32;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-3, 3), share(0.1, 0.9);
  for (int run = 0; run < 2000; ++run) {
    const int degree = run % 3;
    const auto one = [&](int least) { return degree >= least ? Values{value(random)} : Values{}; };
    Trajectory t = make({{1, one(0), one(1), one(2), {}}, {3, one(0), one(1), one(2), {}}});
    t.begin(Time{}, Time{}, state({value(random)}, {value(random)}, {value(random)}), kNoWraps);
    const double time = 1 + 2 * share(random), h = 1e-4;
    const JointStates before = at(t, time - h), here = at(t, time), after = at(t, time + h);
    EXPECT_NEAR(here.velocities[0], (after.positions[0] - before.positions[0]) / (2 * h), 1e-5);
    EXPECT_NEAR(here.accelerations[0], (after.velocities[0] - before.velocities[0]) / (2 * h), 1e-5);
  }
}

// jtc.md, B30.
TEST(JtcTrajectory, RestToRestMatchesClosedForm) {
  Trajectory cubic = make({{2, {1}, {0}, {}, {}}}), quintic = make({{2, {1}, {0}, {0}, {}}});
  cubic.begin(Time{}, Time{}, state({0}, {0}), kNoWraps);
  quintic.begin(Time{}, Time{}, state({0}, {0}, {0}), kNoWraps);
  for (const double s : {0.0, 0.25, 0.5, 0.9}) {
    EXPECT_NEAR(at(cubic, 2 * s).positions[0], s * s * (3 - 2 * s), 1e-12);
    EXPECT_NEAR(at(cubic, 2 * s).velocities[0], 6 * s * (1 - s) / 2, 1e-12);
    EXPECT_NEAR(at(quintic, 2 * s).positions[0], s * s * s * (10 + s * (-15 + 6 * s)), 1e-12);
    EXPECT_NEAR(at(quintic, 2 * s).velocities[0], 30 * s * s * (1 - s) * (1 - s) / 2, 1e-12);
  }
}

// jtc.md, B31.
TEST(JtcTrajectory, StartStateHasFieldsOfFirstPoint) {
  Trajectory t = make({{1, {1}, {0}, {0}, {}}});
  t.begin(Time{}, Time{}, state({0}), kNoWraps);
  // A quintic from rest, not the straight line that a start without derivatives would give.
  EXPECT_NEAR(at(t, 0.25).positions[0], 0.103515625, 1e-12);
  EXPECT_NEAR(at(t, 0).velocities[0], 0, 1e-12);
  EXPECT_NEAR(at(t, 0).accelerations[0], 0, 1e-12);
}

// jtc.md, B32.
TEST(JtcTrajectory, VelocitiesAreIntegratedByTrapezoids) {
  Trajectory t = make({{1, {}, {2}, {}, {}}, {2, {}, {2}, {}, {}}, {3, {}, {0}, {}, {}}});
  t.begin(Time{}, Time{}, state({10}), kNoWraps);
  EXPECT_DOUBLE_EQ(at(t, 1).positions[0], 11);
  EXPECT_DOUBLE_EQ(at(t, 2).positions[0], 13);
  EXPECT_DOUBLE_EQ(at(t, 3).positions[0], 14);
  EXPECT_DOUBLE_EQ(at(t, 1).velocities[0], 2);
  EXPECT_NEAR(at(t, 1.5).positions[0], 12, 1e-12);
}

// jtc.md, B32.
TEST(JtcTrajectory, AccelerationsAreIntegratedTwice) {
  Trajectory t = make({{1, {}, {}, {4}, {}}, {2, {}, {}, {0}, {}}});
  t.begin(Time{}, Time{}, state({0}, {1}), kNoWraps);
  EXPECT_DOUBLE_EQ(at(t, 1).velocities[0], 1 + 0.5 * 4);
  EXPECT_DOUBLE_EQ(at(t, 1).positions[0], 0.5 * (1 + 3));
  EXPECT_DOUBLE_EQ(at(t, 2).velocities[0], 3 + 0.5 * 4);
  EXPECT_DOUBLE_EQ(at(t, 2).positions[0], 2 + 0.5 * (3 + 5));
}

// jtc.md, B33.
TEST(JtcTrajectory, PositionsOfSkippedSegmentsAreDeduced) {
  Trajectory t = make({{1, {}, {2}, {}, {}}, {1.0001, {}, {0}, {}, {}}});
  t.begin(Time{}, Time{}, state({0}), kNoWraps);
  EXPECT_NEAR(at(t, 7).positions[0], 1.0001, 1e-12);  // the last segment was never sampled
}

// jtc.md, B33.
TEST(JtcTrajectory, UnknownStartGivesNoSample) {
  Trajectory t = make({{1, {}, {2}, {}, {}}});
  JointStates out(1);
  EXPECT_FALSE(t.sample(Time{}, Interpolation::splines, out));  // not started
  t.begin(Time{}, Time{}, state({std::nan("")}), kNoWraps);
  EXPECT_FALSE(t.sample(time_from_seconds(5), Interpolation::splines, out));
  t.begin(time_from_seconds(3), time_from_seconds(3), state({0}), kNoWraps);
  EXPECT_FALSE(t.sample(time_from_seconds(2), Interpolation::splines, out));  // before the start
  Trajectory empty(1, 0);
  empty.begin(Time{}, Time{}, state({0}), kNoWraps);
  EXPECT_FALSE(empty.sample(Time{}, Interpolation::splines, out));
}

// jtc.md, B33.
TEST(JtcTrajectory, RestartDeducesPositionsAgain) {
  Trajectory t = make({{1, {}, {2}, {}, {}}});
  t.begin(Time{}, Time{}, state({0}), kNoWraps);
  EXPECT_DOUBLE_EQ(at(t, 1).positions[0], 1);
  t.begin(Time{}, Time{}, state({5}), kNoWraps);
  EXPECT_DOUBLE_EQ(at(t, 1).positions[0], 6);
}

// jtc.md, B34.
TEST(JtcTrajectory, InterpolationNoneStepsToNextPoint) {
  Trajectory t = make({{1, {1}, {}, {}, {}}, {2, {2}, {}, {}, {}}, {3, {3}, {}, {}, {}}});
  t.begin(Time{}, Time{}, state({0.5}), kNoWraps);
  const auto p = [&](double time) { return at(t, time, Interpolation::none).positions[0]; };
  EXPECT_DOUBLE_EQ(p(0), 0.5);
  EXPECT_DOUBLE_EQ(p(0.999), 0.5);
  EXPECT_DOUBLE_EQ(p(1), 2);
  EXPECT_DOUBLE_EQ(p(2), 3);
  EXPECT_DOUBLE_EQ(p(9), 3);
  EXPECT_DOUBLE_EQ(at(t, 1.5, Interpolation::none).velocities[0], 0);  // nothing is derived
}

// jtc.md, B35.
TEST(JtcTrajectory, EffortIsLinearAndZeroWhereAbsent) {
  Trajectory t = make({{1, {1}, {}, {}, {2}}, {3, {1}, {}, {}, {6}}, {4, {1}, {}, {}, {}}});
  JointStates before = state({0});
  before.effort[0] = std::nan("");  // nothing commanded yet
  t.begin(Time{}, Time{}, before, kNoWraps);
  EXPECT_DOUBLE_EQ(at(t, 0.5).effort[0], 1);
  EXPECT_DOUBLE_EQ(at(t, 2).effort[0], 4);
  EXPECT_DOUBLE_EQ(at(t, 3.5).effort[0], 3);
  EXPECT_DOUBLE_EQ(at(t, 5).effort[0], 0);
}

// jtc.md, B36.
TEST(JtcTrajectory, FirstPointAtZeroJumps) {
  Trajectory t = make({{0, {3}, {}, {}, {}}, {1, {4}, {}, {}, {}}});
  t.begin(Time{}, Time{}, state({0}), kNoWraps);
  EXPECT_DOUBLE_EQ(at(t, 0).positions[0], 3);
  EXPECT_DOUBLE_EQ(at(t, 0.5).positions[0], 3.5);
}

// jtc.md, B37.
TEST(JtcTrajectory, SampleAfterEndIsLastPoint) {
  Trajectory t = make({{1, {2}, {}, {}, {}}});
  t.begin(Time{}, Time{}, state({0}), kNoWraps);
  const JointStates s = at(t, 99);
  EXPECT_DOUBLE_EQ(s.positions[0], 2);
  EXPECT_DOUBLE_EQ(s.velocities[0], 0);
  EXPECT_DOUBLE_EQ(s.accelerations[0], 0);
  EXPECT_DOUBLE_EQ(s.effort[0], 0);
}

// jtc.md, B25.
TEST(JtcTrajectory, PastStampStartsInMiddle) {
  Trajectory t = make({{1, {1}, {}, {}, {}}, {3, {3}, {}, {}, {}}}, 1, 10);
  t.begin(time_from_seconds(12), time_from_seconds(12), state({0}), kNoWraps);
  EXPECT_DOUBLE_EQ(at(t, 12).positions[0], 2);
}

// jtc.md, B26.
TEST(JtcTrajectory, FutureStampStartsImmediately) {
  Trajectory t = make({{1, {3}, {}, {}, {}}}, 1, 12);
  t.begin(time_from_seconds(10), time_from_seconds(10), state({0}), kNoWraps);
  EXPECT_DOUBLE_EQ(at(t, 11).positions[0], 1);
  EXPECT_DOUBLE_EQ(at(t, 13).positions[0], 3);
}

// jtc.md, B41.
TEST(JtcTrajectory, ContinuousJointStartsShortestWay) {
  const auto start = [](double from, double to, bool wraps) {
    Trajectory t = make({{1, {to}, {}, {}, {}}});
    t.begin(Time{}, Time{}, state({from}), {wraps});
    return at(t, 0).positions[0];
  };
  EXPECT_NEAR(start(3.0, -3.0, true), 3.0 - 2 * kPi, 1e-12);
  EXPECT_NEAR(start(3.0, -3.0, false), 3.0, 1e-12);
  EXPECT_NEAR(start(0.1, 6 * kPi, true), 6 * kPi + 0.1, 1e-12);
  EXPECT_NEAR(start(0.5, 1.0, true), 0.5, 1e-12);
  // Exactly half a turn: in the direction that the values give.
  EXPECT_NEAR(start(0, kPi, true), 0, 1e-12);
  EXPECT_NEAR(start(kPi, 0, true), kPi, 1e-12);
  EXPECT_NEAR(start(0, -kPi, true), 0, 1e-12);
}

// jtc.md, B41.
TEST(JtcTrajectory, OnlyWrappingJointsAreShifted) {
  Trajectory t = make({{1, {0, 0, 0}, {}, {}, {}}}, 3);
  t.begin(Time{}, Time{}, state({6, 6, 6}), {true, false, true});
  EXPECT_THAT(at(t, 0).positions,
              ElementsAre(DoubleNear(6 - 2 * kPi, 1e-12), 6, DoubleNear(6 - 2 * kPi, 1e-12)));
}

// jtc.md, B8.
TEST(JtcTrajectory, ShortestAngularDistanceIsWrapped) {
  EXPECT_NEAR(shortest_angular_distance(3.1, -3.1), 2 * kPi - 6.2, 1e-12);
  EXPECT_NEAR(shortest_angular_distance(-3.1, 3.1), 6.2 - 2 * kPi, 1e-12);
  EXPECT_NEAR(shortest_angular_distance(1, 1 + 8 * kPi), 0, 1e-12);
  EXPECT_NEAR(shortest_angular_distance(0, 0.5), 0.5, 1e-12);
}

TEST(JtcTrajectory, InterpolationDegreeCanChangePerPoint) {
  Trajectory t = make({{1, {1}, {0}, {}, {}}, {2, {2}, {}, {}, {}}, {3, {3}, {0}, {0}, {}}});
  t.begin(Time{}, Time{}, state({0}), kNoWraps);
  EXPECT_DOUBLE_EQ(at(t, 0.5).positions[0], 0.5);
  EXPECT_DOUBLE_EQ(at(t, 1.25).positions[0], 1.25);  // one end lacks velocities: a line
  EXPECT_DOUBLE_EQ(at(t, 2.25).positions[0], 2.25);
}

}  // namespace
}  // namespace doppel::jtc
