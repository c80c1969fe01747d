// Positions and efforts of a recording at common times, filtered alike.
#include <algorithm>
#include <cmath>

#include "doppel/base/core/diagnostic.h"
#include "doppel/review/identification/detail/low_pass.h"
#include "doppel/review/identification/inverse_model.h"

namespace doppel {
namespace {

using identification_detail::low_pass_reach;
using identification_detail::low_passed;

constexpr double kFilterSigma = 0.015;  // s
constexpr double kGap = 5;              // periods without a sample, at which the recording is divided
constexpr double kMinEffort = 1e-9;     // N m or N, of a joint that measures its effort

double median_period(const std::vector<double>& times) {
  std::vector<double> periods;
  for (std::size_t i = 1; i < times.size(); ++i) periods.push_back(times[i] - times[i - 1]);
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  return *middle;
}

// Cubic through the four nearest samples (Lagrange).
double cubic_at(const PositionCurve& curve, double time) {
  const std::vector<double>& t = curve.time;
  const auto behind = static_cast<std::ptrdiff_t>(std::ranges::lower_bound(t, time) - t.begin());
  const std::ptrdiff_t count = std::min<std::ptrdiff_t>(4, static_cast<std::ptrdiff_t>(t.size()));
  const std::ptrdiff_t first =
      std::clamp<std::ptrdiff_t>(behind - 2, 0, static_cast<std::ptrdiff_t>(t.size()) - count);
  double out = 0;
  for (std::ptrdiff_t i = first; i < first + count; ++i) {
    double weight = 1;
    for (std::ptrdiff_t k = first; k < first + count; ++k) {
      if (k != i)
        weight *= (time - t[static_cast<std::size_t>(k)]) /
                  (t[static_cast<std::size_t>(i)] - t[static_cast<std::size_t>(k)]);
    }
    out += weight * curve.position[static_cast<std::size_t>(i)];
  }
  return out;
}

struct Grid {
  double begin = 0, step = 0;
  Eigen::Index size = 0;
};

Eigen::VectorXd filtered(const PositionCurve& curve, const Grid& grid) {
  Eigen::VectorXd out(grid.size);
  for (Eigen::Index i = 0; i < grid.size; ++i)
    out[i] = cubic_at(curve, grid.begin + static_cast<double>(i) * grid.step);
  return low_passed(out, kFilterSigma / grid.step);
}

struct MeasuredJoint {
  int joint = -1;
  const PositionCurve* position = nullptr;
  const PositionCurve* effort = nullptr;
};

class Sampling {
 public:
  Sampling(const Model& model, std::vector<MeasuredJoint> joints, TorqueRecord& out)
      : model_(model), joints_(std::move(joints)), out_(out) {}

  void add_part(double begin, double end, double period) {
    const Grid grid{begin, period, static_cast<Eigen::Index>((end - begin) / period) + 1};
    const Eigen::Index edge = low_pass_reach(kFilterSigma / period) + 2;
    if (grid.size <= 2 * edge) return;
    std::vector<Eigen::VectorXd> positions, efforts;
    for (const MeasuredJoint& one : joints_) {
      positions.push_back(filtered(*one.position, grid));
      efforts.push_back(one.effort != nullptr ? filtered(*one.effort, grid) : Eigen::VectorXd());
    }
    for (Eigen::Index i = edge; i < grid.size - edge; ++i) add_sample(grid, i, positions, efforts);
    out_.parts.push_back(static_cast<int>(rows_.size()));
  }

  void finish() {
    const auto n = static_cast<Eigen::Index>(rows_.size());
    const auto drives = static_cast<Eigen::Index>(out_.drives.size());
    out_.q.resize(n, model_.nq);
    out_.v.resize(n, model_.nv);
    out_.a.resize(n, model_.nv);
    out_.effort.resize(n, drives);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Row& row = rows_[static_cast<std::size_t>(i)];
      out_.q.row(i) = row.q;
      out_.v.row(i) = row.v;
      out_.a.row(i) = row.a;
      out_.effort.row(i) = row.effort;
    }
  }

 private:
  struct Row {
    Eigen::VectorXd q, v, a, effort;
  };
  void add_sample(const Grid& grid, Eigen::Index i, const std::vector<Eigen::VectorXd>& positions,
                  const std::vector<Eigen::VectorXd>& efforts) {
    Row row{model_.neutral(), Eigen::VectorXd::Zero(model_.nv), Eigen::VectorXd::Zero(model_.nv),
            Eigen::VectorXd::Zero(static_cast<Eigen::Index>(out_.drives.size()))};
    Eigen::Index drive = 0;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const ModelJoint& joint = model_.joints[static_cast<std::size_t>(joints_[k].joint)];
      const Eigen::VectorXd& p = positions[k];
      row.q[joint.q] = p[i];
      row.v[joint.v] = (p[i + 1] - p[i - 1]) / (2 * grid.step);
      row.a[joint.v] = (p[i + 1] - 2 * p[i] + p[i - 1]) / (grid.step * grid.step);
      if (joints_[k].effort != nullptr) row.effort[drive++] = efforts[k][i];
    }
    model_.apply_mimics(row.q);
    for (const ModelJoint& joint : model_.joints) {
      if (!joint.mimics()) continue;
      const int leader = model_.joints[static_cast<std::size_t>(joint.mimic_leader)].v;
      row.v[joint.v] = joint.mimic_multiplier * row.v[leader];
      row.a[joint.v] = joint.mimic_multiplier * row.a[leader];
    }
    out_.time.push_back(grid.begin + static_cast<double>(i) * grid.step);
    rows_.push_back(std::move(row));
  }

  const Model& model_;
  std::vector<MeasuredJoint> joints_;
  TorqueRecord& out_;
  std::vector<Row> rows_;
};

bool has_effort(const PositionCurve& curve) {
  return std::ranges::any_of(curve.position, [](double one) { return std::abs(one) > kMinEffort; });
}

}  // namespace

TorqueRecord torque_record(const Model& model, const MeasuredMotion& motion) {
  TorqueRecord out;
  std::vector<MeasuredJoint> joints;
  const std::vector<double>* clock = nullptr;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    const auto position = motion.measured.find(joint.name);
    if (!joint.scalar() || joint.mimics() || position == motion.measured.end()) continue;
    if (position->second.time.size() < 2) continue;
    MeasuredJoint one{static_cast<int>(i), &position->second, nullptr};
    const auto effort = motion.efforts.find(joint.name);
    if (effort != motion.efforts.end() && effort->second.time.size() > 1 && has_effort(effort->second)) {
      one.effort = &effort->second;
      out.drives.push_back(static_cast<int>(i));
      clock = &position->second.time;
    }
    joints.push_back(one);
  }
  if (clock == nullptr) {
    throw InputError(
        "identify.no_efforts", {}, "the recording has no efforts: joint_states has none, or they are all 0",
        "a description whose joints have <state_interface name=\"effort\"/>, and servos that measure it");
  }
  const double period = out.period = median_period(*clock);
  Sampling sampling(model, std::move(joints), out);
  for (std::size_t begin = 0, i = 1; i <= clock->size(); ++i) {
    if (i < clock->size() && (*clock)[i] - (*clock)[i - 1] < kGap * period) continue;
    sampling.add_part((*clock)[begin], (*clock)[i - 1], period);
    begin = i;
  }
  sampling.finish();
  return out;
}

}  // namespace doppel
