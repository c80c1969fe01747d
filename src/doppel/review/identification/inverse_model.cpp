#include "doppel/review/identification/inverse_model.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <random>

#include "doppel/base/core/diagnostic.h"
#include "doppel/review/identification/detail/fit_statistics.h"
#include "doppel/review/identification/detail/low_pass.h"
#include "doppel/review/identification/detail/physical_bodies.h"
#include "doppel/robot/kinematics/dynamics_regressor.h"

namespace doppel {
namespace {

using identification_detail::CombinationCost;

constexpr int kDriveParameters = 3;  // armature, viscous, friction
constexpr int kStatesPerParameter = 4;
constexpr double kDependent = 1e-7;    // of the largest pivot
constexpr double kNoShare = 1e-9;      // of a coefficient of a combination
constexpr double kMinSpeed = 0.02;     // rad/s or m/s, at which a joint moves and friction has its sign
constexpr double kCountedShare = 0.8;  // of a filtered sample
constexpr double kRowSigma = 0.03,
                 kEffortSigma = 0.015;  // s, of the filters of this file and of torque_record()
constexpr Eigen::Index kKeptEach = 3;   // samples
constexpr double kHeldBlock = 1.0;      // s, of training and held-out samples in turn
constexpr double kTwoSigma = 1.96;      // of a 95 % interval
constexpr int kMaxLags = 100;
constexpr int kSamplesPerParameter = 5;
constexpr double kIdentifiedShare = 0.35;  // of the value, half an interval of an identified one
constexpr double kLearned = 0.1;  // of the prior's sigma, below which the recording has said something
constexpr double kNoLoss = 1e-6;  // N m ..., of a drive whose loss is described as 0
constexpr int kMaxNamedTerms = 4;
constexpr int kBodyRounds = 4;  // of weights by what the bodies leave

const char* const kParameterNames[] = {"m", "m cx", "m cy", "m cz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"};
const char* const kDriveNames[] = {"armature", "viscous", "friction"};

// -- the parameters of a model, and how they act on the drives' efforts

class ParameterSpace {
 public:
  ParameterSpace(const Model& model, const std::vector<int>& drives, const Eigen::Vector3d& gravity)
      : model_(model), drives_(drives), gravity_(gravity), data_(model) {
    for (std::size_t i = 1; i < model.links.size(); ++i) {
      if (model.links[i].inertia && moves(static_cast<int>(i))) links_.push_back(static_cast<int>(i));
    }
  }

  [[nodiscard]] const std::vector<int>& links() const { return links_; }
  [[nodiscard]] Eigen::Index link_count() const { return static_cast<Eigen::Index>(links_.size()); }
  [[nodiscard]] Eigen::Index drive_count() const { return static_cast<Eigen::Index>(drives_.size()); }
  [[nodiscard]] Eigen::Index first_drive() const { return kInertialParameters * link_count(); }
  [[nodiscard]] Eigen::Index size() const { return first_drive() + kDriveParameters * drive_count(); }

  // Efforts of the drives = out * parameters; a mimic's load is its leader's.
  void regressor(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& a,
                 Eigen::MatrixXd& out) {
    dynamics_regressor(model_, data_, q, v, a, gravity_, whole_);
    out.setZero(drive_count(), size());
    for (Eigen::Index d = 0; d < drive_count(); ++d) {
      const int drive = drives_[static_cast<std::size_t>(d)];
      for (std::size_t j = 0; j < model_.joints.size(); ++j) {
        const ModelJoint& joint = model_.joints[j];
        const bool is_drive = static_cast<int>(j) == drive;
        if (!is_drive && joint.mimic_leader != drive) continue;
        const double share = is_drive ? 1.0 : joint.mimic_multiplier;
        for (Eigen::Index k = 0; k < link_count(); ++k) {
          out.row(d).segment<kInertialParameters>(kInertialParameters * k) +=
              share * whole_.row(joint.v).segment<kInertialParameters>(kInertialParameters *
                                                                       links_[static_cast<std::size_t>(k)]);
        }
      }
      const int i = model_.joints[static_cast<std::size_t>(drive)].v;
      const Eigen::Index column = first_drive() + kDriveParameters * d;
      out(d, column) = a[i];
      out(d, column + 1) = v[i];
      out(d, column + 2) = v[i] > 0 ? 1.0 : (v[i] < 0 ? -1.0 : 0.0);
    }
  }

  [[nodiscard]] Eigen::VectorXd described(const std::vector<DriveLosses>& losses) const {
    Eigen::VectorXd out(size());
    for (Eigen::Index k = 0; k < link_count(); ++k) {
      out.segment<kInertialParameters>(kInertialParameters * k) = inertial_parameters(
          *model_.links[static_cast<std::size_t>(links_[static_cast<std::size_t>(k)])].inertia);
    }
    for (Eigen::Index d = 0; d < drive_count(); ++d) {
      const DriveLosses& one = losses[static_cast<std::size_t>(d)];
      out.segment<kDriveParameters>(first_drive() + kDriveParameters * d) << one.armature, one.viscous,
          one.friction;
    }
    return out;
  }

  [[nodiscard]] bool is_sign(Eigen::Index parameter) const {
    return parameter >= first_drive() && (parameter - first_drive()) % kDriveParameters == 2;
  }
  [[nodiscard]] std::string name(Eigen::Index parameter) const {
    if (parameter < first_drive()) {
      const int link = links_[static_cast<std::size_t>(parameter / kInertialParameters)];
      return fmt::format("{} of '{}'", kParameterNames[parameter % kInertialParameters],
                         model_.links[static_cast<std::size_t>(link)].name);
    }
    const Eigen::Index d = (parameter - first_drive()) / kDriveParameters;
    const int drive = drives_[static_cast<std::size_t>(d)];
    return fmt::format("{} of '{}'", kDriveNames[(parameter - first_drive()) % kDriveParameters],
                       model_.joints[static_cast<std::size_t>(drive)].name);
  }

 private:
  [[nodiscard]] bool moves(int link) const {
    for (int up = model_.links[static_cast<std::size_t>(link)].joint; up >= 0;) {
      const ModelJoint& joint = model_.joints[static_cast<std::size_t>(up)];
      if (joint.nv > 0) return true;
      up = model_.links[static_cast<std::size_t>(joint.parent_link)].joint;
    }
    return false;
  }

  const Model& model_;
  const std::vector<int>& drives_;
  Eigen::Vector3d gravity_;
  Data data_;
  std::vector<int> links_;
  Eigen::MatrixXd whole_;
};

// QR with column pivoting of the regressor of random states (Gautier 1991): the columns that are combinations
// of others are added to those. The states are the same in every call.
BaseCombinations combinations_of(const Model& model, ParameterSpace& space) {
  std::mt19937_64 bits(1);
  const auto unit = [&] { return 2 * (static_cast<double>(bits() >> 11U) * 0x1p-53) - 1; };
  const Eigen::Index n = space.size(), drives = std::max<Eigen::Index>(space.drive_count(), 1);
  const Eigen::Index states = kStatesPerParameter * n / drives + 1;
  Eigen::MatrixXd W(states * drives, n), rows;
  Eigen::VectorXd q = model.neutral(), v = Eigen::VectorXd::Zero(model.nv), a = v;
  for (Eigen::Index s = 0; s < states; ++s) {
    for (const ModelJoint& joint : model.joints) {
      if (!joint.scalar() || joint.mimics()) continue;
      q[joint.q] = (joint.type == JointType::prismatic ? 0.3 : 3.0) * unit();
      v[joint.v] = 2 * unit();
      a[joint.v] = 5 * unit();
    }
    model.apply_mimics(q);
    for (const ModelJoint& joint : model.joints) {
      if (!joint.mimics()) continue;
      const int leader = model.joints[static_cast<std::size_t>(joint.mimic_leader)].v;
      v[joint.v] = joint.mimic_multiplier * v[leader];
      a[joint.v] = joint.mimic_multiplier * a[leader];
    }
    space.regressor(q, v, a, rows);
    W.middleRows(s * drives, drives) = rows;
  }
  Eigen::VectorXd lengths = W.colwise().norm();
  const double longest = lengths.size() > 0 ? lengths.maxCoeff() : 0.0;
  for (double& one : lengths) one = one > kDependent * longest ? one : 0.0;
  for (Eigen::Index j = 0; j < n; ++j) W.col(j) *= lengths[j] > 0 ? 1 / lengths[j] : 0.0;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(W);
  qr.setThreshold(kDependent);
  const Eigen::Index rank = qr.rank();
  const Eigen::MatrixXd R = qr.matrixR().topRows(rank);
  const Eigen::MatrixXd shares = R.leftCols(rank).triangularView<Eigen::Upper>().solve(R.rightCols(n - rank));
  const auto place = qr.colsPermutation().indices();
  BaseCombinations out;
  out.links = space.links();
  out.B = Eigen::MatrixXd::Zero(rank, n);
  for (Eigen::Index i = 0; i < rank; ++i) {
    out.columns.push_back(place[i]);
    out.B(i, place[i]) = 1;
    for (Eigen::Index k = 0; k < n - rank; ++k) {
      const double share = shares(i, k) * lengths[place[rank + k]] / lengths[place[i]];
      if (std::abs(shares(i, k)) > kNoShare) out.B(i, place[rank + k]) = share;
    }
  }
  return out;
}

std::string name_of_combination(const ParameterSpace& space, const BaseCombinations& base, Eigen::Index i) {
  std::string out = space.name(base.columns[static_cast<std::size_t>(i)]);
  int terms = 0;
  for (Eigen::Index j = 0; j < base.B.cols(); ++j) {
    const double share = base.B(i, j);
    if (share == 0 || j == base.columns[static_cast<std::size_t>(i)]) continue;
    if (++terms >= kMaxNamedTerms) continue;
    const std::string size =
        std::abs(std::abs(share) - 1) < kNoShare ? "" : fmt::format("{:.3g} ", std::abs(share));
    out += fmt::format(" {} {}{}", share < 0 ? "-" : "+", size, space.name(j));
  }
  if (terms >= kMaxNamedTerms) out += fmt::format(" and {} more", terms - kMaxNamedTerms + 1);
  return out;
}

// -- the regression

struct Estimate {
  Eigen::VectorXd b, g;   // combinations; the normal equations' right side
  Eigen::MatrixXd H;      // of the weighted efforts
  Eigen::VectorXd sigma;  // of the residuals of each drive
};

class Regression {
 public:
  Regression(const Model& model, const TorqueRecord& record, const std::vector<DriveLosses>& described,
             const Eigen::Vector3d& gravity)
      : model_(model), record_(record), space_(model, record.drives, gravity) {
    base_ = combinations_of(model, space_);
    described_ = space_.described(described);
    for (std::size_t i = 0; i < record.parts.size(); ++i)
      add_part(i > 0 ? record.parts[i - 1] : 0, record.parts[i]);
    spread_ = prior_spread();
  }
  InverseModel run();

 private:
  [[nodiscard]] bool is_held_out(Eigen::Index sample) const {
    const double since = time_[static_cast<std::size_t>(sample)] - time_.front();
    return static_cast<std::size_t>(since / kHeldBlock) % 10 % 3 == 2;
  }
  [[nodiscard]] bool counts(Eigen::Index sample, Eigen::Index drive) const {
    return moving_[static_cast<std::size_t>(sample * space_.drive_count() + drive)] != 0;
  }
  void add_part(Eigen::Index begin, Eigen::Index end);
  [[nodiscard]] Eigen::VectorXd prior_spread() const;
  [[nodiscard]] Estimate solved(bool with_held_out, const Eigen::VectorXd& sigma) const;
  [[nodiscard]] Estimate estimate(bool with_held_out) const;
  [[nodiscard]] Eigen::VectorXd residual_sigma(const Eigen::VectorXd& b, bool held_out, bool training) const;
  [[nodiscard]] Eigen::MatrixXd covariance(const Estimate& fit, double& inflation) const;
  [[nodiscard]] Eigen::VectorXd weighted_bodies(const Estimate& fit, double inflation) const;
  [[nodiscard]] Eigen::VectorXd bodies(const Estimate& fit, bool with_held_out, double inflation) const;
  void judge_base(const Estimate& fit, const Eigen::MatrixXd& C, InverseModel& out) const;
  void judge_errors(InverseModel& out) const;
  void name_bodies(const Eigen::VectorXd& fitted, InverseModel& out) const;

  const Model& model_;
  const TorqueRecord& record_;
  ParameterSpace space_;
  BaseCombinations base_;
  Eigen::VectorXd described_, spread_;
  std::vector<double> time_;
  Eigen::MatrixXd W_;         // [samples * drives, combinations]
  Eigen::MatrixXd effort_;    // [samples, drives]
  std::vector<char> moving_;  // [samples * drives]
};

// The columns are filtered as the efforts are, so that the filter does not separate them where a friction
// changes its sign (Gautier 1997). Of every kKeptEach-th sample, whose neighbours say the same.
void Regression::add_part(Eigen::Index begin, Eigen::Index end) {
  const Eigen::Index n = end - begin, m = base_.B.rows(), drives = space_.drive_count();
  const double sigma = kRowSigma / record_.period, effort = kEffortSigma / record_.period;
  const Eigen::Index edge = identification_detail::low_pass_reach(sigma);
  std::vector<Eigen::MatrixXd> raw(static_cast<std::size_t>(drives), Eigen::MatrixXd(n, m + 2));
  Eigen::MatrixXd rows;
  for (Eigen::Index s = 0; s < n; ++s) {
    space_.regressor(record_.q.row(begin + s), record_.v.row(begin + s), record_.a.row(begin + s), rows);
    for (Eigen::Index d = 0; d < drives; ++d) {
      Eigen::MatrixXd& one = raw[static_cast<std::size_t>(d)];
      for (Eigen::Index i = 0; i < m; ++i) one(s, i) = rows(d, base_.columns[static_cast<std::size_t>(i)]);
      const int v = model_.joints[static_cast<std::size_t>(record_.drives[static_cast<std::size_t>(d)])].v;
      one(s, m) = record_.effort(begin + s, d);
      one(s, m + 1) = std::abs(record_.v(begin + s, v)) > kMinSpeed ? 1.0 : 0.0;
    }
  }
  for (Eigen::MatrixXd& one : raw) {
    // The other columns are of filtered positions; a sign is not.
    for (Eigen::Index i = 0; i < m; ++i) {
      if (space_.is_sign(base_.columns[static_cast<std::size_t>(i)]))
        one.col(i) = identification_detail::low_passed(one.col(i), effort);
    }
    one = identification_detail::low_passed(one, sigma);
  }
  Eigen::Index row = effort_.rows();
  const Eigen::Index added = std::max<Eigen::Index>((n - 2 * edge + kKeptEach - 1) / kKeptEach, 0);
  W_.conservativeResize((row + added) * drives, m);
  effort_.conservativeResize(row + added, drives);
  for (Eigen::Index s = edge; s < n - edge; s += kKeptEach, ++row) {
    time_.push_back(record_.time[static_cast<std::size_t>(begin + s)]);
    for (Eigen::Index d = 0; d < drives; ++d) {
      const Eigen::MatrixXd& one = raw[static_cast<std::size_t>(d)];
      W_.row(row * drives + d) = one.row(s).head(m);
      effort_(row, d) = one(s, m);
      moving_.push_back(one(s, m + 1) > kCountedShare ? 1 : 0);
    }
  }
}

// A combination is at most about as large as the described parameters, or as the recorded efforts permit.
Eigen::VectorXd Regression::prior_spread() const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(base_.B.rows());
  const double effort = effort_.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    const double strongest = W_.col(i).cwiseAbs().maxCoeff();
    const double by_description = base_.B.row(i).cwiseAbs().dot(described_.cwiseAbs());
    out[i] = std::max({3 * by_description, strongest > 0 ? 0.3 * effort / strongest : 0.0, 1e-12});
  }
  return out;
}

Estimate Regression::solved(bool with_held_out, const Eigen::VectorXd& sigma) const {
  const Eigen::Index m = W_.cols(), drives = space_.drive_count();
  Estimate out;
  out.sigma = sigma;
  out.H = Eigen::MatrixXd::Zero(m, m);
  out.g = Eigen::VectorXd::Zero(m);
  for (Eigen::Index s = 0; s < effort_.rows(); ++s) {
    if (!with_held_out && is_held_out(s)) continue;
    for (Eigen::Index d = 0; d < drives; ++d) {
      if (!counts(s, d)) continue;
      const double weight = 1 / (sigma[d] * sigma[d]);
      const auto row = W_.row(s * drives + d);
      out.H.selfadjointView<Eigen::Lower>().rankUpdate(row.transpose(), weight);
      out.g += weight * effort_(s, d) * row.transpose();
    }
  }
  out.H = Eigen::MatrixXd(out.H.selfadjointView<Eigen::Lower>());
  Eigen::MatrixXd A = out.H;
  A.diagonal() += spread_.cwiseInverse().cwiseAbs2();
  const Eigen::VectorXd start = base_.B * described_;
  out.b = A.ldlt().solve(out.g + spread_.cwiseInverse().cwiseAbs2().cwiseProduct(start));
  return out;
}

Eigen::VectorXd Regression::residual_sigma(const Eigen::VectorXd& b, bool held_out, bool training) const {
  const Eigen::Index drives = space_.drive_count();
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(drives), n = sum;
  for (Eigen::Index s = 0; s < effort_.rows(); ++s) {
    if (is_held_out(s) ? !held_out : !training) continue;
    for (Eigen::Index d = 0; d < drives; ++d) {
      if (!counts(s, d)) continue;
      const double e = effort_(s, d) - W_.row(s * drives + d).dot(b);
      sum[d] += e * e;
      n[d] += 1;
    }
  }
  return (sum.cwiseQuotient(n.cwiseMax(1.0))).cwiseSqrt();
}

// Two rounds: equal weights, then those of each drive's residuals.
Estimate Regression::estimate(bool with_held_out) const {
  const double effort = std::max(effort_.cwiseAbs().maxCoeff(), kNoLoss);
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(space_.drive_count(), 0.01 * effort);
  for (int round = 0; round < 2; ++round) {
    sigma = residual_sigma(solved(with_held_out, sigma).b, with_held_out, true).cwiseMax(1e-6 * effort);
  }
  return solved(with_held_out, sigma);
}

// It is computed from the long-run covariance of the scores, as in fit_servo(), and never narrower than for
// white residuals.
Eigen::MatrixXd Regression::covariance(const Estimate& fit, double& inflation) const {
  const Eigen::Index m = W_.cols(), drives = space_.drive_count(), samples = effort_.rows();
  Eigen::MatrixXd scores = Eigen::MatrixXd::Zero(samples, m);
  for (Eigen::Index s = 0; s < samples; ++s) {
    for (Eigen::Index d = 0; d < drives; ++d) {
      if (!counts(s, d)) continue;
      const auto row = W_.row(s * drives + d);
      scores.row(s) += (effort_(s, d) - row.dot(fit.b)) / (fit.sigma[d] * fit.sigma[d]) * row;
    }
  }
  const int lags = std::min(kMaxLags, static_cast<int>(samples) / 50);
  const Eigen::MatrixXd S =
      identification_detail::long_run_scores(scores, Eigen::VectorXd::Ones(samples), lags);
  Eigen::MatrixXd A = fit.H;
  A.diagonal() += spread_.cwiseInverse().cwiseAbs2();
  const Eigen::MatrixXd plain = A.ldlt().solve(Eigen::MatrixXd::Identity(m, m));
  Eigen::MatrixXd out = plain * S * plain;
  out.diagonal() += plain.cwiseAbs2() * spread_.cwiseInverse().cwiseAbs2();
  inflation = 0;
  for (Eigen::Index j = 0; j < m; ++j) {
    inflation += std::max(out(j, j) / plain(j, j), 1.0) / static_cast<double>(m);
    out(j, j) = std::max(out(j, j), plain(j, j));
  }
  return out;
}

// The bodies that efforts with these weights ask for.
Eigen::VectorXd Regression::weighted_bodies(const Estimate& fit, double inflation) const {
  // The minimum of the efforts alone; directions without information do not count.
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(fit.H);
  const double most = axes.eigenvalues().maxCoeff();
  Eigen::VectorXd inverse = axes.eigenvalues();
  for (double& one : inverse) one = one > 1e-13 * most ? 1 / one : 0.0;
  const Eigen::VectorXd b =
      axes.eigenvectors() * inverse.asDiagonal() * axes.eigenvectors().transpose() * fit.g;
  const Eigen::MatrixXd H = fit.H / inflation;
  Eigen::VectorXd start = described_;
  for (Eigen::Index i = space_.first_drive(); i < start.size(); ++i) {
    const Eigen::Index kind = (i - space_.first_drive()) % kDriveParameters;
    const auto found = std::ranges::find(base_.columns, static_cast<int>(i));
    const double fitted = found == base_.columns.end() ? 0.0 : b[found - base_.columns.begin()];
    if (!(start[i] > 0)) start[i] = std::max(fitted, kind == 0 ? 1e-2 * kNoLoss : kNoLoss);
  }
  return identification_detail::nearest_bodies({base_.B, H, b}, start, static_cast<int>(space_.link_count()));
}

// If no body has the combinations, as with efforts that are sampled at one phase of the drive's cycle, what
// remains of the efforts is larger than the combinations leave. The weights are those of that remainder:
// with the smaller one, the search would go to absurd bodies for efforts that none can explain.
Eigen::VectorXd Regression::bodies(const Estimate& fit, bool with_held_out, double inflation) const {
  Eigen::VectorXd out = weighted_bodies(fit, inflation);
  for (int round = 0; round < kBodyRounds; ++round) {
    const Eigen::VectorXd sigma = residual_sigma(base_.B * out, with_held_out, true).cwiseMax(fit.sigma);
    Estimate reweighted = solved(with_held_out, sigma);
    reweighted.b = base_.B * out;
    static_cast<void>(covariance(reweighted, inflation));
    out = weighted_bodies(reweighted, inflation);
  }
  return out;
}

void Regression::judge_base(const Estimate& fit, const Eigen::MatrixXd& C, InverseModel& out) const {
  const Eigen::VectorXd described = base_.B * described_;
  for (Eigen::Index i = 0; i < fit.b.size(); ++i) {
    const double sigma = std::sqrt(C(i, i)), half = kTwoSigma * sigma;
    BaseParameter one;
    one.name = name_of_combination(space_, base_, i);
    one.value = fit.b[i];
    one.low = fit.b[i] - half;
    one.high = fit.b[i] + half;
    one.described = described[i];
    if (half < kIdentifiedShare * std::abs(fit.b[i])) {
      one.verdict = BaseVerdict::identified;
    } else if (sigma < kLearned * spread_[i]) {
      one.verdict = BaseVerdict::zero;
    }
    out.base.push_back(std::move(one));
  }
}

void Regression::judge_errors(InverseModel& out) const {
  const Estimate training = estimate(false);
  double inflation = 1;
  static_cast<void>(covariance(training, inflation));
  const Eigen::VectorXd physical = base_.B * bodies(training, false, inflation);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(physical.size());
  const auto held_out = [&](const Eigen::VectorXd& b) { return residual_sigma(b, true, false); };
  const Eigen::VectorXd effort = held_out(zero), described = held_out(base_.B * described_),
                        base = held_out(training.b), body = held_out(physical);
  for (Eigen::Index d = 0; d < space_.drive_count(); ++d) {
    const int joint = record_.drives[static_cast<std::size_t>(d)];
    TorqueErrors one{
        model_.joints[static_cast<std::size_t>(joint)].name, effort[d], described[d], base[d], body[d], 0};
    for (Eigen::Index s = 0; s < effort_.rows(); ++s) one.samples += is_held_out(s) && counts(s, d) ? 1 : 0;
    out.errors.push_back(std::move(one));
  }
}

void Regression::name_bodies(const Eigen::VectorXd& fitted, InverseModel& out) const {
  for (Eigen::Index k = 0; k < space_.link_count(); ++k) {
    const int link = space_.links()[static_cast<std::size_t>(k)];
    const Eigen::Index first = kInertialParameters * k;
    if (base_.B.middleCols<kInertialParameters>(first).isZero(0)) continue;
    out.links.push_back({link, *model_.links[static_cast<std::size_t>(link)].inertia,
                         mass_properties(fitted.segment<kInertialParameters>(first))});
  }
  for (Eigen::Index d = 0; d < space_.drive_count(); ++d) {
    const Eigen::Index first = space_.first_drive() + kDriveParameters * d;
    const auto losses = [&](const Eigen::VectorXd& p) {
      return DriveLosses{p[first], p[first + 1], p[first + 2]};
    };
    const auto knows = [&](Eigen::Index parameter) {
      for (std::size_t i = 0; i < base_.columns.size(); ++i) {
        const bool alone = base_.columns[i] == first + parameter &&
                           base_.B.row(static_cast<Eigen::Index>(i)).cwiseAbs().sum() == 1;
        if (alone) return out.base[i].verdict == BaseVerdict::identified;
      }
      return false;
    };
    out.drives.push_back({record_.drives[static_cast<std::size_t>(d)], losses(described_), losses(fitted),
                          knows(0), knows(1), knows(2)});
  }
}

InverseModel Regression::run() {
  InverseModel out;
  out.parameters = static_cast<int>(space_.size());
  out.samples = static_cast<int>(effort_.rows());
  const auto moving = std::ranges::count(moving_, 1);
  if (moving < kSamplesPerParameter * base_.B.rows()) {
    throw InputError(
        "identify.too_short", {},
        fmt::format("the recording has {} efforts of joints in motion; {} unknown combinations need {}",
                    moving, base_.B.rows(), kSamplesPerParameter * base_.B.rows()),
        "record a motion of at least 30 s in which all joints move");
  }
  const Estimate fit = estimate(true);
  const Eigen::MatrixXd C = covariance(fit, out.inflation);
  judge_base(fit, C, out);
  judge_errors(out);
  name_bodies(bodies(fit, true, out.inflation), out);
  return out;
}

}  // namespace

int InverseModel::count(BaseVerdict verdict) const {
  return static_cast<int>(std::ranges::count(base, verdict, &BaseParameter::verdict));
}

bool InverseModel::is_better() const {
  double before = 0, after = 0;
  for (const TorqueErrors& one : errors) {
    const double scale = std::max(one.effort * one.effort, 1e-300);
    before += one.samples * one.described * one.described / scale;
    after += one.samples * one.physical * one.physical / scale;
  }
  return after < before;
}

InverseModel fit_inverse_model(const Model& model, const TorqueRecord& record,
                               const std::vector<DriveLosses>& described, const Eigen::Vector3d& gravity) {
  return Regression(model, record, described, gravity).run();
}

BaseCombinations base_combinations(const Model& model, const std::vector<int>& drives,
                                   const Eigen::Vector3d& gravity) {
  ParameterSpace space(model, drives, gravity);
  return combinations_of(model, space);
}

}  // namespace doppel
