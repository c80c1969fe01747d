// Clearance::edge(): spans of an edge, one in each lane, halved until they are proven.
#include <algorithm>
#include <cmath>
#include <limits>

#include "doppel/robot/clearance/detail/clearance_impl.h"

namespace doppel {
namespace {

constexpr double kRateMargin = 1e-6;  // of a bound of motion, for its rounding to float
constexpr double kMinMeasured =
    0.004;  // m of motion: spans that move more are halved before triangles are asked
constexpr double kGapMargin = 1e-9;  // m, of the distance of triangles

// The states from t - half to t + half.
struct EdgeSpan {
  double t = 0, half = 0;
  int depth = 0;
};

class EdgeSearch {
 public:
  EdgeSearch(Clearance::Impl& memory, const ConstVector& q0, const ConstVector& q1, bool first)
      : m_(memory), q0_(q0), q1_(q1), first_(first), n_(static_cast<std::size_t>(memory.variables())) {
    u0_.resize(n_);
    u1_.resize(n_);
    m_.lanes->variables_of(q0, u0_.data());
    m_.lanes->variables_of(q1, u1_.data());
  }

  EdgeClearance run() {
    if (!q0_.allFinite() || !q1_.allFinite() || !m_.lanes->in_range(u0_) || !m_.lanes->in_range(u1_)) {
      out_.free = false;
      out_.parameter = 0;
      out_.resolution = true;
      return out_;
    }
    m_.lanes->motion(u0_, u1_, m_.motion);
    for (std::size_t p = 0; p < m_.motion.size(); ++p)
      m_.rates[p] = static_cast<float>(m_.motion[p] * (1 + kRateMargin));
    std::ranges::fill(m_.solid, char{0});
    constexpr int kRake = kLaneCount;
    for (int i = kRake - 1; i >= 0; --i) waiting_.push_back({(i + 0.5) / kRake, 0.5 / kRake, 0});
    while (!waiting_.empty() && !(done_ && !first_)) step();
    return out_;
  }

 private:
  // The next spans: the first ones of the edge, or, if any contact will do, the longest ones.
  void step() {
    const std::size_t count = std::min<std::size_t>(waiting_.size(), kLaneCount);
    batch_.clear();
    if (first_) {
      for (std::size_t i = 0; i < count; ++i) batch_.push_back(waiting_[waiting_.size() - 1 - i]);
      waiting_.resize(waiting_.size() - count);
    } else {
      batch_.assign(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
      waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
    }
    std::erase_if(batch_, [&](const EdgeSpan& span) { return span.t - span.half >= out_.parameter; });
    if (batch_.empty()) return;
    for (std::size_t lane = 0; lane < batch_.size(); ++lane) {
      for (std::size_t v = 0; v < n_; ++v) m_.u[lane * n_ + v] = u0_[v] + batch_[lane].t * (u1_[v] - u0_[v]);
      m_.spans[lane] = static_cast<float>(batch_[lane].half * (1 + kRateMargin));
    }
    const int lanes = static_cast<int>(batch_.size());
    out_.states += lanes;
    children_.clear();
    if (const std::uint32_t open = m_.run(lanes, kCoverLevels, false, true); open != 0) {
      near_ = m_.touching;
      look_for_contacts(open, lanes);
      for (std::size_t lane = 0; lane < batch_.size() && !(done_ && !first_); ++lane) {
        if ((open >> lane & 1U) != 0) prove(lane);
      }
    }
    if (first_) {
      waiting_.insert(waiting_.end(), children_.rbegin(), children_.rend());
    } else {
      waiting_.insert(waiting_.end(), children_.begin(), children_.end());
    }
  }

  // Deep contacts are found at once, so that no span beside them is halved in vain.
  void look_for_contacts(std::uint32_t open, int lanes) {
    if (batch_.front().depth % 2 != 0) return;
    const std::uint32_t touching = m_.run(lanes, kCoverLevels, false, false) & open;
    for (std::size_t lane = 0; lane < batch_.size() && touching != 0; ++lane) {
      if ((touching >> lane & 1U) == 0 || batch_[lane].t >= out_.parameter) continue;
      place(lane);
      for (std::size_t p = 0; p < m_.touching.size(); ++p) {
        if ((m_.touching[p] >> lane & 1U) == 0) continue;
        m_.solid[p] = 1;
        if (!m_.touches(p)) continue;
        contact(p, batch_[lane].t, false);
        break;
      }
      if (done_ && !first_) return;
    }
  }

  void place(std::size_t lane) {
    q_ = q0_ + batch_[lane].t * (q1_ - q0_);
    m_.place({m_.u.data() + lane * n_, n_}, q_);
  }

  void contact(std::size_t pair, double t, bool by_resolution) {
    if (t > out_.parameter) return;
    done_ = true;
    out_.free = false;
    out_.parameter = t;
    out_.a = m_.pair(pair).first;
    out_.b = m_.pair(pair).second;
    out_.resolution = by_resolution;
  }

  void halve(const EdgeSpan& span) {
    const double quarter = span.half / 2;
    children_.push_back({span.t - quarter, quarter, span.depth + 1});
    children_.push_back({span.t + quarter, quarter, span.depth + 1});
  }

  // A span whose spheres do not prove it: by the triangles of its pairs, or in halves.
  void prove(std::size_t lane) {
    const EdgeSpan span = batch_[lane];
    if (span.t - span.half >= out_.parameter) return;
    for (std::size_t p = 0; p < near_.size(); ++p) {
      if ((near_[p] >> lane & 1U) == 0) continue;
      const double moves = m_.motion[p] * span.half;
      if (moves > std::max(kMinMeasured, accuracy(p))) return halve(span);
    }
    place(lane);
    for (std::size_t p = 0; p < near_.size(); ++p) {
      if ((near_[p] >> lane & 1U) == 0) continue;
      if (m_.solid[p] == 0) {
        m_.solid[p] = 1;
        if (m_.touches(p)) {
          contact(p, span.t, false);
          return halve(span);
        }
      }
      ++out_.measured;
      const double moves = m_.motion[p] * span.half;
      const double needed = moves + m_.padding(p) + kGapMargin;
      if (m_.gap(p, needed * 1.01 + kGapMargin, needed) > needed) continue;
      if (2 * moves > m_.options.resolution) return halve(span);
      return contact(p, std::max(span.t - span.half, 0.0), true);
    }
  }

  // m: spheres of this pair overlap where the bodies are apart by less.
  [[nodiscard]] double accuracy(std::size_t pair) const {
    double sum = 0;
    for (const int body : {m_.pair(pair).a, m_.pair(pair).b}) {
      const auto* const shapes = m_.lanes->bodies()[static_cast<std::size_t>(body)].shapes;
      double worst = 0;
      if (shapes != nullptr) {
        for (const ShapeCover& shape : *shapes) worst = std::max(worst, shape.cover.excess[2]);
      }
      sum += worst;
    }
    return sum;
  }

  Clearance::Impl& m_;
  const ConstVector &q0_, &q1_;
  const bool first_;
  bool done_ = false;
  std::size_t n_;
  std::vector<double> u0_, u1_;
  Eigen::VectorXd q_;
  std::vector<EdgeSpan> waiting_, batch_, children_;
  std::vector<std::uint32_t> near_;  // [pairs] of the batch, with its motion
  EdgeClearance out_;
};

}  // namespace

EdgeClearance Clearance::edge(const ConstVector& q0, const ConstVector& q1, bool first) {
  return EdgeSearch(*impl_, q0, q1, first).run();
}

}  // namespace doppel
