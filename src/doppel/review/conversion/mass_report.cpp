#include "doppel/review/conversion/mass_report.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "doppel/review/conversion/detail/quantities.h"
#include "doppel/review/conversion/detail/table.h"
#include "doppel/review/conversion/tree_labels.h"
#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/semantics/self_collision.h"

namespace doppel {
namespace {

LinkMass link_mass(const std::string& name, const MassProperties& body, double total) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(body.I, Eigen::EigenvaluesOnly);
  const double gyration = body.mass > 0 ? std::sqrt(std::max(0.0, 0.5 * body.I.trace() / body.mass)) : 0.0;
  return {name, body.mass, total > 0 ? body.mass / total : 0.0, body.com, gyration, eigen.eigenvalues()};
}

std::vector<JointLoad> joint_loads(const Model& model, int samples) {
  Data data(model);
  const auto loads_at = [&](const Eigen::VectorXd& q) -> Eigen::VectorXd {
    gravity_torques(model, data, q, kGravity);
    Eigen::VectorXd torques;
    drive_torques(model, data, torques);
    return torques;
  };
  const Eigen::VectorXd at_zero = loads_at(model.neutral());
  Eigen::VectorXd worst = at_zero.cwiseAbs();
  std::uint64_t state = 1;
  for (int i = 0; i < samples; ++i)
    worst = worst.cwiseMax(loads_at(random_configuration(model, state)).cwiseAbs());
  std::vector<JointLoad> loads;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    if (!joint.scalar() || joint.mimics()) continue;
    const auto at = static_cast<Eigen::Index>(i);
    JointLoad load{joint.name, joint.type == JointType::prismatic, at_zero[at], worst[at], {}, {}};
    if (std::isfinite(joint.effort)) {
      load.effort = joint.effort;
      load.margin = joint.effort - worst[at];
    }
    loads.push_back(load);
  }
  return loads;
}

// "-0.0" is "0.0".
std::string without_minus_zero(const std::string& number) {
  return number.find_first_of("123456789") == std::string::npos && number.starts_with('-') ? number.substr(1)
                                                                                           : number;
}

std::string three(const Eigen::Vector3d& v, double factor, int digits) {
  std::string out;
  for (int i = 0; i < 3; ++i) {
    const std::string number = fmt::format("{:.{}f}", v[i] * factor, digits);
    out += (i == 0 ? "" : " ") + without_minus_zero(number);
  }
  return out;
}

}  // namespace

MassReport mass_report(const Model& model, int samples) {
  MassReport report;
  Data data(model);
  forward_kinematics(model, data, model.neutral());
  MassProperties all;
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    if (model.links[i].inertia) all = combined(all, transformed(*model.links[i].inertia, data.X_WL[i]));
  }
  report.total = all.mass;
  report.com = all.com;
  for (const ModelLink& link : model.links) {
    if (link.inertia) report.links.push_back(link_mass(link.name, *link.inertia, all.mass));
  }
  report.joints = joint_loads(model, samples);
  return report;
}

std::string mass_text(const MassReport& report) {
  std::vector<TableRow> links = {
      {"link", "mass", "share", "centre [mm]", "gyration [mm]", "principal moments [kg m^2]"}};
  for (const LinkMass& link : report.links) {
    links.push_back({link.link, mass_word(link.mass), fmt::format("{:.1f} %", link.share * 100),
                     three(link.com, 1e3, 1), fmt::format("{:.1f}", link.gyration * 1e3),
                     fmt::format("{:.3e} {:.3e} {:.3e}", link.moments[0], link.moments[1], link.moments[2])});
  }
  std::string out = text_table(links, {1, 2, 3, 4});
  out += fmt::format("\ntotal {}, centre of mass at zero {} mm\n", mass_word(report.total),
                     three(report.com, 1e3, 1));
  if (report.joints.empty()) return out;
  std::vector<TableRow> joints = {
      {"joint", "gravity at zero", "in worst case", "limit", "left in worst case"}};
  for (const JointLoad& load : report.joints) {
    const char* unit = load.slides ? "N" : "N m";
    TableRow row = {load.joint, fmt::format("{:+.3f} {}", load.at_zero, unit),
                    fmt::format("{:.3f} {}", load.worst, unit)};
    if (load.effort) {
      const bool holds = *load.margin >= 0;
      row.push_back(fmt::format("{:.4g} {}", *load.effort, unit));
      row.push_back(holds ? fmt::format("{:.0f} %", *load.effort > 0 ? 100 * *load.margin / *load.effort : 0)
                          : "cannot hold");
    } else {
      row.insert(row.end(), {"none", ""});
    }
    joints.push_back(std::move(row));
  }
  return out + "\n" + text_table(joints, {1, 2, 3, 4});
}

std::string compared_with_scale(const MassReport& report, double measured) {
  const double excess = report.total - measured;
  if (std::abs(excess) <= 1e-3 * measured) {
    return fmt::format("measured mass {}: the description agrees to {:.2f} %\n", mass_word(measured),
                       100 * std::abs(excess) / measured);
  }
  std::string out =
      fmt::format("measured mass {}: the description is {} too {} ({:+.1f} %)\n", mass_word(measured),
                  mass_word(std::abs(excess)), excess > 0 ? "heavy" : "light", 100 * excess / measured);
  if (report.total > 0)
    out += fmt::format(
        "  fix: multiply every mass and inertia tensor by {:.4f} (overlay operation scale_masses)\n",
        measured / report.total);
  return out;
}

}  // namespace doppel
