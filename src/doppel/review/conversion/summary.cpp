#include "doppel/review/conversion/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <vector>

#include "doppel/description/meshes/mesh_report.h"
#include "doppel/review/conversion/detail/quantities.h"
#include "doppel/review/conversion/detail/table.h"
#include "doppel/review/conversion/tree_labels.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/robot/semantics/self_collision.h"

namespace doppel {
namespace {

constexpr int kReachSamples = 4000;

void extend(Eigen::AlignedBox3d& bounds, const Geometry& geometry, const Pose& X) {
  const auto shape = report_shape(geometry);
  if (!shape) return;
  for (const Eigen::Vector3d& p : shape->hull) bounds.extend(X * p);
  if (!shape->hull.empty() || shape->bounds.isEmpty()) return;
  for (int corner = 0; corner < 8; ++corner)
    bounds.extend(X * shape->bounds.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
}

Eigen::AlignedBox3d bounds_at_zero(const RobotDescription& robot, const Model& model) {
  Data data(model);
  forward_kinematics(model, data, model.neutral());
  Eigen::AlignedBox3d bounds;
  for (const Link& link : robot.links) {
    const int index = model.find_link(link.name);
    if (index < 0) continue;
    for (const Visual& visual : link.visuals)
      extend(bounds, visual.geometry, data.X_WL[index] * visual.origin.pose());
    for (const Collision& collision : link.collisions)
      extend(bounds, collision.geometry, data.X_WL[index] * collision.origin.pose());
  }
  return bounds;
}

void find_reach(const Model& model, RobotSummary& out) {
  const auto moves = [](const ModelJoint& joint) { return joint.scalar(); };
  const auto first = std::find_if(model.joints.begin(), model.joints.end(), moves);
  if (first == model.joints.end()) return;
  out.reach_from = first->name;
  std::vector<bool> inner(model.links.size(), false);
  for (const ModelJoint& joint : model.joints) inner[joint.parent_link] = true;
  Data data(model);
  std::uint64_t state = 1;
  for (int i = 0; i < kReachSamples; ++i) {
    forward_kinematics(model, data, random_configuration(model, state));
    const Eigen::Vector3d from = data.X_WL[first->parent_link] * first->X_PJ.translation();
    for (std::size_t link = 0; link < model.links.size(); ++link) {
      if (inner[link]) continue;
      const double distance = (data.X_WL[link].translation() - from).norm();
      if (distance <= out.reach) continue;
      out.reach = distance;
      out.reach_tip = model.links[link].name;
    }
  }
}

MeshSummary count_meshes(const RobotDescription& robot) {
  MeshSummary out;
  std::set<std::string> seen;
  const auto count = [&](const Geometry& geometry) {
    const auto* mesh = std::get_if<MeshGeometry>(&geometry);
    if (mesh == nullptr || !seen.insert(mesh->path.empty() ? mesh->uri : mesh->path).second) return;
    if (mesh->path.empty()) {
      out.missing.push_back(mesh->uri);
      return;
    }
    ++out.files;
    const MeshReport& report = cached_mesh_report(mesh->path);
    out.triangles += report.triangles;
    if (!report.problem.empty()) out.unreadable.push_back(mesh->path + ": " + report.problem);
  };
  for (const Link& link : robot.links) {
    for (const Visual& visual : link.visuals) count(visual.geometry);
    for (const Collision& collision : link.collisions) count(collision.geometry);
  }
  return out;
}

// The limits of URDF 1.2 that a joint has: a column each.
std::vector<RateLimit> rate_columns(const RobotDescription& robot) {
  std::vector<RateLimit> used;
  for (const RateLimit& rate : kRateLimits) {
    const auto has_it = [&rate](const Joint& joint) { return joint.limits && (*joint.limits).*rate.value; };
    if (std::ranges::any_of(robot.joints, has_it)) used.push_back(rate);
  }
  return used;
}

std::string joint_table(const RobotDescription& robot) {
  std::vector<TableRow> rows = {
      {"joint", "type", "lower", "upper", "effort", "velocity", "damping", "friction"}};
  const std::vector<RateLimit> rates = rate_columns(robot);
  std::vector<std::size_t> right = {2, 3, 4, 5, 6, 7};
  for (const RateLimit& column : rates) {
    right.push_back(rows[0].size());
    rows[0].push_back(column.name);
  }
  for (const Joint& joint : robot.joints) {
    if (joint.type == JointType::fixed) continue;
    const bool angle = turns(joint.type);
    const double scale = angle ? kDegreesPerRadian : 1.0;
    TableRow row = {joint.name, type_word(joint.type)};
    if (joint.mimic)
      row.back() += fmt::format(", follows {:g} x {}", joint.mimic->multiplier, joint.mimic->joint);
    const bool limited = joint.limits && joint.limits->has_position && joint.type != JointType::continuous;
    for (const double limit : {limited ? joint.limits->lower : 0, limited ? joint.limits->upper : 0})
      row.push_back(limited ? fmt::format("{:.4g} {}", limit * scale, angle ? "deg" : "m") : "");
    const auto shown = [](const std::optional<double>& value, const char* unit) {
      return value ? fmt::format("{:.4g} {}", *value, unit) : std::string();
    };
    row.push_back(joint.limits ? shown(joint.limits->effort, angle ? "N m" : "N") : "");
    row.push_back(joint.limits ? shown(joint.limits->velocity, angle ? "rad/s" : "m/s") : "");
    row.push_back(joint.dynamics ? fmt::format("{:.4g}", joint.dynamics->damping) : "");
    row.push_back(joint.dynamics ? fmt::format("{:.4g}", joint.dynamics->friction) : "");
    for (const RateLimit& column : rates) {
      const char* const unit = angle ? column.angular : column.linear;
      row.push_back(joint.limits ? shown((*joint.limits).*column.value, unit) : "");
    }
    rows.push_back(std::move(row));
  }
  return rows.size() == 1 ? "" : "\n" + text_table(rows, right);
}

std::string interfaces(const std::vector<HardwareInterfaceDescription>& all) {
  std::string out;
  for (const auto& one : all) out += (out.empty() ? "" : ", ") + one.name;
  return out.empty() ? "nothing" : out;
}

// Each component; joints with the same interfaces are listed together.
std::string hardware_lines(const RobotDescription& robot) {
  std::string out;
  for (const HardwareDescription& hardware : robot.hardware) {
    out += fmt::format("  ros2_control   {} ({}), {}\n", hardware.name, hardware.type, hardware.plugin);
    std::vector<std::pair<std::string, int>> kinds;
    for (const HardwareJointDescription& joint : hardware.joints) {
      const std::string kind = fmt::format("command {}; state {}", interfaces(joint.command_interfaces),
                                           interfaces(joint.state_interfaces));
      const auto found =
          std::find_if(kinds.begin(), kinds.end(), [&kind](const auto& k) { return k.first == kind; });
      if (found == kinds.end()) {
        kinds.emplace_back(kind, 1);
      } else {
        ++found->second;
      }
    }
    for (const auto& [kind, count] : kinds)
      out += fmt::format("                 {} joint{}: {}\n", count, count == 1 ? "" : "s", kind);
  }
  return out;
}

std::string mesh_lines(const MeshSummary& meshes) {
  std::string out = fmt::format("  meshes         {} file{}, {} triangles\n", meshes.files,
                                meshes.files == 1 ? "" : "s", meshes.triangles);
  constexpr std::size_t kShown = 3;
  for (std::size_t i = 0; i < std::min(kShown, meshes.missing.size()); ++i)
    out += fmt::format("                 missing: {}\n", meshes.missing[i]);
  if (meshes.missing.size() > kShown)
    out += fmt::format("                 and {} more are missing\n", meshes.missing.size() - kShown);
  for (const std::string& file : meshes.unreadable)
    out += fmt::format("                 unreadable: {}\n", file);
  return out;
}

std::string controller_lines(const Surroundings& surroundings) {
  std::string out;
  for (const JointGroup& controller : surroundings.controllers) {
    out +=
        fmt::format("  {:<14} {} ({})", out.empty() ? "controllers" : "", controller.name, controller.type);
    const std::size_t joints = controller.joints.size();
    out += joints == 0 ? "\n" : fmt::format(", {} joint{}\n", joints, joints == 1 ? "" : "s");
  }
  for (const auto& file : surroundings.controller_files)
    out += fmt::format("                 from {}\n", file.string());
  return out;
}

}  // namespace

RobotSummary summarise(const RobotDescription& robot, const Model& model) {
  RobotSummary out;
  out.mass = model.total_mass;
  out.driven = static_cast<int>(model.driven_joint_names().size());
  find_reach(model, out);
  out.bounds = bounds_at_zero(robot, model);
  out.meshes = count_meshes(robot);
  return out;
}

std::string summary_text(const RobotDescription& robot, const RobotSummary& summary,
                         const Surroundings& surroundings) {
  std::string out = headline(robot) + "\n";
  const auto& files = surroundings.files;
  for (std::size_t i = 0; i < files.size(); ++i)
    out += fmt::format("  {:<14} {}\n", i == 0 ? "file" : i == 1 ? "and read" : "", files[i].string());
  out += fmt::format("  corrections    {}\n", surroundings.overlay);
  out += fmt::format("  driven         {} joint{}\n", summary.driven, summary.driven == 1 ? "" : "s");
  if (!summary.reach_tip.empty()) {
    out += fmt::format("  reach          {:.3g} m from {} to {}\n", summary.reach, summary.reach_from,
                       summary.reach_tip);
  }
  if (!summary.bounds.isEmpty()) {
    const Eigen::Vector3d size = summary.bounds.sizes();
    out += fmt::format("  size at zero   {:.3g} x {:.3g} x {:.3g} m, from {} to {}\n", size.x(), size.y(),
                       size.z(), short_numbers(summary.bounds.min()), short_numbers(summary.bounds.max()));
  }
  out += mesh_lines(summary.meshes) + hardware_lines(robot);
  for (const GazeboExtension& gazebo : robot.gazebo) {
    for (const GazeboPlugin& plugin : gazebo.plugins) {
      out += fmt::format("  plugin         {} ({})\n", plugin.name, plugin.filename);
      for (const std::string& file : plugin.parameter_files)
        out += fmt::format("                 {}\n", file);
    }
  }
  out += controller_lines(surroundings);
  for (const Transmission& transmission : robot.transmissions)
    out += fmt::format("  transmission   {} ({})\n", transmission.name, transmission.type);
  return out + joint_table(robot);
}

}  // namespace doppel
