#include "reach_sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "doppel/robot/clearance/test/clearance_robots.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel::bench {
namespace {

constexpr std::uint64_t kSweepSeed = 7;

// FCL judges by its own trees and primitives, which share nothing with the scene but the files.
class FclJudge {
 public:
  FclJudge(const RobotDescription& robot, const CollisionScene& scene)
      : scene_(scene),
        model_(*scene.instances().front().model),
        data_(model_),
        links_(test::fcl_links(robot, scene.instances().front())) {}

  // The first pair that touches at q [nq].
  [[nodiscard]] std::optional<std::pair<BodyId, BodyId>> touching(const Eigen::VectorXd& q) {
    forward_kinematics(model_, data_, q);
    for (const auto& pair : scene_.tested_pairs()) {
      if (touch(pair)) return pair;
    }
    return std::nullopt;
  }

 private:
  [[nodiscard]] bool touch(const std::pair<BodyId, BodyId>& pair) const {
    const auto a = static_cast<std::size_t>(pair.first.link), b = static_cast<std::size_t>(pair.second.link);
    return test::parts_touch(links_[a], data_.X_WL[a], links_[b], data_.X_WL[b]);
  }

  const CollisionScene& scene_;
  const Model& model_;
  Data data_;
  std::vector<test::FclParts> links_;
};

}  // namespace

SweepCounts sweep(const RobotDescription& robot, const std::shared_ptr<const Model>& model, ArmReach& reach,
                  const std::shared_ptr<const CollisionScene>& scene,
                  const std::shared_ptr<const InstanceCovers>& covers, int states) {
  FclJudge judge(robot, *scene);
  Clearance clearance(scene, {covers});
  std::mt19937_64 random(kSweepSeed);
  const auto name = [&model](BodyId body) { return model->links[static_cast<std::size_t>(body.link)].name; };
  SweepCounts out;
  std::map<std::string, int> times;
  for (int i = 0; i < states; ++i) {
    const Eigen::VectorXd q = test::random_state(*model, random);
    const auto pair = judge.touching(q);
    const bool touching = pair.has_value(), free = reach.is_free(q);
    const StateClearance covered = clearance.state(q);
    ++out.states;
    if (touching) ++times[name(pair->first) + " and " + name(pair->second)];
    out.touching += touching ? 1 : 0;
    out.free_wrong += free && touching ? 1 : 0;
    out.touching_wrong += !free && !touching ? 1 : 0;
    out.covers_free_wrong += covered.free && touching ? 1 : 0;
    out.covers_touching_wrong += !covered.free && !touching ? 1 : 0;
    if (!out.first.empty() || (free != touching && covered.free != touching)) continue;
    if (touching) {
      out.first = fmt::format("{} and {} touch by FCL", name(pair->first), name(pair->second));
    } else if (!covered.free) {
      out.first = fmt::format("{} and {} are free by FCL", name(covered.a), name(covered.b));
    } else {
      const auto contacts = reach.context()->contacts();
      out.first = contacts.empty() ? "free by FCL"
                                   : fmt::format("{} and {} are free by FCL", name(contacts.front().a),
                                                 name(contacts.front().b));
    }
  }
  const auto often = std::max_element(times.begin(), times.end(),
                                      [](const auto& a, const auto& b) { return a.second < b.second; });
  if (often != times.end()) out.often = fmt::format("{}: {}", often->first, often->second);
  return out;
}

}  // namespace doppel::bench
