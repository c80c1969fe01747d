// compute_ik, compute_fk and check_state_validity. Source: moveit_ros/move_group's
// kinematics_service_capability.cpp and state_validation_service_capability.cpp (moveit2, jazzy).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/base/core/thrown.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/sensors/rigs/pose_messages.h"
#include "doppel/twin/arms/detail/arm_answers.h"

namespace doppel {
namespace {

using moveit_msgs::msg::ContactInformation;
using moveit_msgs::msg::MoveItErrorCodes;
using moveit_msgs::msg::PositionIKRequest;
namespace msrv = moveit_msgs::srv;

constexpr double kAttemptSeconds = 2e-6;  // of one attempt, roughly: a timeout is a number of attempts here

struct WantedTip {
  std::string link;
  geometry_msgs::msg::PoseStamped pose;
};

std::vector<WantedTip> tips_of(const PositionIKRequest& request) {
  if (request.ik_link_names.empty()) return {{request.ik_link_name, request.pose_stamped}};
  if (request.ik_link_names.size() != request.pose_stamped_vector.size()) {
    throw MoveItError{MoveItErrorCodes::INVALID_GOAL_CONSTRAINTS,
                      fmt::format("the request has {} links and {} poses", request.ik_link_names.size(),
                                  request.pose_stamped_vector.size())};
  }
  std::vector<WantedTip> out;
  for (std::size_t i = 0; i < request.ik_link_names.size(); ++i)
    out.push_back({request.ik_link_names[i], request.pose_stamped_vector[i]});
  return out;
}

// Nanoseconds count, too; 0 is the default.
int attempts_in(const builtin_interfaces::msg::Duration& timeout) {
  const double seconds = timeout.sec + timeout.nanosec * 1e-9;
  if (seconds <= 0) return kIkAttempts;
  return static_cast<int>(std::clamp(seconds / kAttemptSeconds, 1.0, static_cast<double>(kIkAttempts)));
}

// The group of a tip among several: the one that ends there.
std::string group_of(const ArmContext& context, const std::string& link, const std::string& fallback) {
  for (const ArmGroup& group : context.arms.groups()) {
    if (context.snapshot.model().links[static_cast<std::size_t>(group.chain.tip_link)].name == link)
      return group.name;
  }
  return fallback;
}

ArmReach& arm_for(const ArmContext& context, const std::string& group, const std::string& tip) {
  try {
    return context.arms.arm(group, tip);
  } catch (const InputError& problem) {
    const Diagnostic& first = problem.diagnostics().front();
    const bool of_link = first.rule == "reach.unknown_link" || first.rule == "reach.no_chain";
    throw MoveItError{of_link ? MoveItErrorCodes::INVALID_LINK_NAME : MoveItErrorCodes::INVALID_GROUP_NAME,
                      first.fix.empty() ? first.message : first.message + "; " + first.fix};
  }
}

bool satisfies(const ArmSnapshot& snapshot, const moveit_msgs::msg::Constraints& constraints,
               const Eigen::VectorXd& q) {
  const auto results = evaluate(snapshot, constraints, q);
  return std::all_of(results.begin(), results.end(), [](const auto& one) { return one.result; });
}

bool is_empty(const moveit_msgs::msg::Constraints& constraints) {
  return constraints.joint_constraints.empty() && constraints.position_constraints.empty() &&
         constraints.orientation_constraints.empty() && constraints.visibility_constraints.empty();
}

// The link that moves a tip: the tip may be a frame of an object that the link holds. Source:
// subframes_test.cpp of moveit_ros/planning_interface.
struct TipFrame {
  std::string link;
  Pose X_LF = Pose::Identity();
};
TipFrame frame_of(const ArmSnapshot& snapshot, const std::string& tip) {
  const Model& model = snapshot.model();
  if (tip.empty() || model.find_link(tip) >= 0) return {tip};
  if (const std::optional<LinkFrame> held = find_held_frame(snapshot, tip))
    return {model.links[static_cast<std::size_t>(held->link)].name, held->X_LF};
  if (!find_frame(snapshot, snapshot.q, tip)) return {tip};
  throw MoveItError{MoveItErrorCodes::INVALID_LINK_NAME,
                    fmt::format("'{}' is attached to no link of the robot, so that no arm moves it", tip)};
}

void solve_tip(const ArmContext& context, const PositionIKRequest& request, const std::string& group,
               const WantedTip& tip, Eigen::VectorXd& q, std::string& notes) {
  const TipFrame frame = frame_of(context.snapshot, tip.link);
  ArmReach& arm = arm_for(context, group, frame.link);
  ReachQuery query;
  query.X_WT = pose_in_root(context.snapshot, q, tip.pose.header.frame_id, checked_pose(tip.pose.pose)) *
               frame.X_LF.inverse(Eigen::Isometry);
  query.q = q;
  query.collisions = request.avoid_collisions;
  query.attempts = attempts_in(request.timeout);
  if (!is_empty(request.constraints)) {
    (void)evaluate(context.snapshot, request.constraints, q);  // refuses what it cannot judge
    query.accepts = [&](const Eigen::VectorXd& state) {
      return satisfies(context.snapshot, request.constraints, state);
    };
  }
  const ReachAnswer answer = arm.answer(query);
  if (!answer.solved) {
    const bool collides =
        answer.failure->obstacle == IkObstacle::refused && request.avoid_collisions && !query.accepts;
    throw MoveItError{collides ? MoveItErrorCodes::GOAL_IN_COLLISION : MoveItErrorCodes::NO_IK_SOLUTION,
                      answer.message};
  }
  q = answer.branches.front().q;
  if (!answer.note.empty()) notes += (notes.empty() ? "" : "; ") + answer.note;
}

// The kind of a body in contacts.
std::uint32_t body_type(const CollisionScene& scene, BodyId body) {
  if (body.instance == 0) return ContactInformation::ROBOT_LINK;
  const bool is_held =
      !body.is_ground() && scene.instances()[static_cast<std::size_t>(body.instance)].held.has_value();
  return is_held ? ContactInformation::ROBOT_ATTACHED : ContactInformation::WORLD_OBJECT;
}

std::string body_name(const CollisionScene& scene, BodyId body) {
  const SceneInstance& instance = scene.instances()[static_cast<std::size_t>(body.instance)];
  if (body.instance == 0) return instance.model->links[static_cast<std::size_t>(body.link)].name;
  return instance.name;
}

ContactInformation contact_message(const CollisionScene& scene, const PairDistance& pair,
                                   const std::string& frame) {
  ContactInformation out;
  out.header.frame_id = frame;
  out.position = to_point_msg(0.5 * (pair.p_a_W + pair.p_b_W));
  out.normal = to_vector_msg(pair.normal_W);
  out.depth = std::max(0.0, -pair.distance);
  out.contact_body_1 = body_name(scene, pair.a);
  out.body_type_1 = body_type(scene, pair.a);
  out.contact_body_2 = body_name(scene, pair.b);
  out.body_type_2 = body_type(scene, pair.b);
  return out;
}

// The links of the group and what they carry; empty: every link.
std::vector<std::uint32_t> links_of_group(const ArmContext& context, const std::string& group) {
  if (group.empty()) return {};
  (void)arm_for(context, group, "");
  return moving_variables(context.snapshot.model(), context.arms.group(group).chain);
}

template <class Answer, class Response>
void answer_or_refuse(Response& response, Answer answer) {
  try {
    answer();
    response.error_code.val = MoveItErrorCodes::SUCCESS;
  } catch (const MoveItError& problem) {
    response.error_code = error_code(problem.code, problem.message);
  } catch (...) {
    refuse(response, thrown_text());
  }
}

}  // namespace

void answer_position_ik(const ArmContext& context, const msrv::GetPositionIK::Request& request,
                        msrv::GetPositionIK::Response& response) {
  const PositionIKRequest& ik_request = request.ik_request;
  std::string notes;
  answer_or_refuse(response, [&] {
    context.arms.show(context.snapshot);
    Eigen::VectorXd q = with_state(context.snapshot, ik_request.robot_state);
    const std::vector<WantedTip> tips = tips_of(ik_request);
    for (const WantedTip& tip : tips)
      solve_tip(context, ik_request,
                tips.size() > 1 ? group_of(context, tip.link, ik_request.group_name) : ik_request.group_name,
                tip, q, notes);
    response.solution = state_message(context.snapshot, q);
  });
  if (response.error_code.val == MoveItErrorCodes::SUCCESS && !notes.empty())
    response.error_code = error_code(MoveItErrorCodes::SUCCESS, notes);
}

void answer_position_fk(const ArmContext& context, const msrv::GetPositionFK::Request& request,
                        msrv::GetPositionFK::Response& response) {
  answer_or_refuse(response, [&] {
    if (request.fk_link_names.empty())
      throw MoveItError{MoveItErrorCodes::INVALID_LINK_NAME, "the request names no link"};
    const Eigen::VectorXd q = with_state(context.snapshot, request.robot_state);
    const Model& model = context.snapshot.model();
    const Pose X_FR =
        pose_in_root(context.snapshot, q, request.header.frame_id, Pose::Identity()).inverse(Eigen::Isometry);
    Data data(model);
    forward_kinematics(model, data, q);
    for (const std::string& name : request.fk_link_names) {
      const int link = model.find_link(name);
      if (link < 0) {
        throw MoveItError{
            MoveItErrorCodes::INVALID_LINK_NAME,
            fmt::format("the robot has no link '{}'{}", name, did_you_mean(name, model.link_names()))};
      }
      geometry_msgs::msg::PoseStamped pose;
      pose.header = request.header;
      if (pose.header.frame_id.empty())
        pose.header.frame_id = model.links[static_cast<std::size_t>(context.snapshot.robot->base_link)].name;
      pose.pose = to_pose_msg(X_FR * data.X_WL[static_cast<std::size_t>(link)]);
      response.pose_stamped.push_back(std::move(pose));
      response.fk_link_names.push_back(name);
    }
  });
}

void answer_state_validity(const ArmContext& context, const msrv::GetStateValidity::Request& request,
                           msrv::GetStateValidity::Response& response) {
  try {
    context.arms.show(context.snapshot);
    const Eigen::VectorXd q = with_state(context.snapshot, request.robot_state);
    const std::vector<std::uint32_t> moved = links_of_group(context, request.group_name);
    CollisionContext& everything = context.arms.everything();
    everything.set_configuration(0, q);
    const std::string frame = context.snapshot.model().links[0].name;
    for (const PairDistance& pair : everything.contacts()) {
      const bool of_robot = body_type(everything.scene(), pair.a) != ContactInformation::WORLD_OBJECT ||
                            body_type(everything.scene(), pair.b) != ContactInformation::WORLD_OBJECT;
      const auto bits = [&moved](BodyId body) {
        return body.instance == 0 ? moved[static_cast<std::size_t>(body.link)] : 0;
      };
      if (!of_robot || (!moved.empty() && bits(pair.a) == 0 && bits(pair.b) == 0)) continue;
      response.contacts.push_back(contact_message(everything.scene(), pair, frame));
    }
    response.constraint_result = evaluate(context.snapshot, request.constraints, q);
    response.valid = response.contacts.empty() &&
                     std::all_of(response.constraint_result.begin(), response.constraint_result.end(),
                                 [](const auto& one) { return one.result; });
  } catch (const MoveItError& problem) {
    response = {};
    context.warn("check_state_validity: " + problem.message);
  } catch (...) {
    response = {};
    context.warn("check_state_validity: " + thrown_text());
  }
}

void refuse(msrv::GetPositionIK::Response& response, const std::string& why) {
  response.error_code = error_code(MoveItErrorCodes::FAILURE, why);
}
void refuse(msrv::GetPositionFK::Response& response, const std::string& why) {
  response.error_code = error_code(MoveItErrorCodes::FAILURE, why);
}
// The answer has no place for a reason.
void refuse(msrv::GetStateValidity::Response& response, const std::string& /*why*/) {
  response.valid = false;
}

}  // namespace doppel
