// Model of Python: a loaded description with its kinematics and dynamics. The functions take and return NumPy
// arrays; python/doppel/_model.py adds names, defaults and texts.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "doppel/base/core/installation.h"
#include "doppel/base/core/names.h"
#include "doppel/robot/ik/ik_failure.h"
#include "doppel/robot/ik/ik_solver.h"
#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/semantics/self_collision.h"
#include "doppel/session/live/audit_result.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/described_model.h"

namespace doppel::python {
namespace {

constexpr std::array kJointTypes{"fixed", "revolute", "continuous", "prismatic", "floating", "planar"};

int link_index(const Model& model, const std::string& name) {
  const int found = model.find_link(name);
  if (found < 0)
    throw InputError(
        "python.unknown_link", {},
        fmt::format("'{}' has no link '{}'{}", model.name, name, did_you_mean(name, model.link_names())),
        "the names are in model.links");
  return found;
}

Numbers fk(const DescribedModel& self, const Numbers& q) {
  const Model& model = *self.model;
  const Eigen::VectorXd at_q = to_vector(q, model.nq, "q");
  Data data(model);
  forward_kinematics(model, data, at_q);
  Numbers out(std::vector<py::ssize_t>{static_cast<py::ssize_t>(model.links.size()), 4, 4});
  for (std::size_t i = 0; i < model.links.size(); ++i) write_pose(data.X_WL[i], out.mutable_data() + 16 * i);
  return out;
}

Numbers jacobian_of(const DescribedModel& self, const Numbers& q, const std::string& link,
                    const Numbers& point) {
  const Model& model = *self.model;
  Data data(model);
  const int index = link_index(model, link);
  forward_kinematics(model, data, to_vector(q, model.nq, "q"));
  Eigen::Matrix<double, 6, Eigen::Dynamic> J = Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, model.nv);
  jacobian(model, data, index, to_vector(point, 3, "point"), J);
  return to_matrix(J);
}

Numbers rnea(const DescribedModel& self, const Numbers& q, const Numbers& v, const Numbers& a,
             const Numbers& gravity) {
  const Model& model = *self.model;
  Data data(model);
  inverse_dynamics(model, data, to_vector(q, model.nq, "q"), to_vector(v, model.nv, "v"),
                   to_vector(a, model.nv, "a"), to_vector(gravity, 3, "gravity"));
  return to_array(data.tau);
}

Numbers mass_matrix_of(const DescribedModel& self, const Numbers& q) {
  Data data(*self.model);
  mass_matrix(*self.model, data, to_vector(q, self.model->nq, "q"));
  return to_matrix(data.M);
}

Numbers gravity_of(const DescribedModel& self, const Numbers& q, const Numbers& gravity) {
  Data data(*self.model);
  gravity_torques(*self.model, data, to_vector(q, self.model->nq, "q"), to_vector(gravity, 3, "gravity"));
  return to_array(data.tau);
}

Numbers random_configurations(const DescribedModel& self, std::uint64_t seed, std::size_t count) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(count), self.model->nq);
  for (Eigen::Index row = 0; row < rows.rows(); ++row)
    rows.row(row) = random_configuration(*self.model, seed).transpose();
  return to_matrix(rows);
}

// Runs `measure` with the robot's links at `q`, without the interpreter's lock.
template <class Measure>
auto at_configuration(const DescribedModel& self, const Numbers& q, Measure measure) {
  const Eigen::VectorXd positions = to_vector(q, self.model->nq, "q");
  const py::gil_scoped_release released;
  CollisionContext context(self.scene());
  context.set_configuration(0, positions);
  return measure(context);
}

using LinkNames = std::pair<std::string, std::string>;

LinkNames names_of(const Model& model, BodyId a, BodyId b) {
  return {model.links[static_cast<std::size_t>(a.link)].name,
          model.links[static_cast<std::size_t>(b.link)].name};
}

std::vector<LinkNames> collisions(const DescribedModel& self, const Numbers& q, double clearance) {
  return at_configuration(self, q, [&](CollisionContext& context) {
    std::vector<LinkNames> out;
    const auto& pairs = context.scene().tested_pairs();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (context.tested_closer(i, clearance + kTouching))
        out.push_back(names_of(*self.model, pairs[i].first, pairs[i].second));
    }
    return out;
  });
}

// m, and the links; none if no two links can touch.
std::pair<double, std::optional<LinkNames>> distance(const DescribedModel& self, const Numbers& q) {
  return at_configuration(self, q, [&](CollisionContext& context) {
    const PairDistance nearest = context.distance();
    std::optional<LinkNames> links;
    if (nearest.distance < kFarAway) links = names_of(*self.model, nearest.a, nearest.b);
    return std::pair(nearest.distance, links);
  });
}

IkTask task_of(const std::string& name) {
  const std::vector<std::string> names{"pose", "axis", "angle", "position"};
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw InputError("python.task", {},
                     fmt::format("'{}' is no task of ik{}", name, did_you_mean(name, names)));
  return static_cast<IkTask>(found - names.begin());
}

// The arguments of ik that have defaults in Python.
struct IkArguments {
  std::string tip, base, task;
  double position_tolerance, rotation_tolerance;
  bool all;
};

Chain chain_of(const Model& model, const IkArguments& arguments) {
  const int base = arguments.base.empty() ? 0 : link_index(model, arguments.base);
  try {
    return make_chain(model, base, link_index(model, arguments.tip));
  } catch (const std::invalid_argument& why) {
    throw InputError("python.chain", {},
                     fmt::format("there is no arm from '{}' to '{}': {}",
                                 model.links[static_cast<std::size_t>(base)].name, arguments.tip, why.what()),
                     "name a tip below the base, with joints between them");
  }
}

// Configurations [n, nq], the nearest to the seed first. Without one: none, with the reason and the nearest.
py::tuple ik(const DescribedModel& self, const Numbers& X_BT, const Numbers& seed,
             const IkArguments& arguments) {
  const Model& model = *self.model;
  Eigen::VectorXd q = to_vector(seed, model.nq, "seed");
  const Pose target = to_pose(X_BT, "target");
  std::vector<Eigen::VectorXd> found;
  std::string why;
  {
    const py::gil_scoped_release released;
    const IkSolver arm(self.model, chain_of(model, arguments));
    IkRequest request{.X_BT = target, .task = task_of(arguments.task)};
    request.seed = arm.chain().variables_of(model, q);
    request.position_tolerance = arguments.position_tolerance;
    request.rotation_tolerance = arguments.rotation_tolerance;
    std::vector<IkSolution> solutions;
    if (arguments.all) {
      solutions = arm.solve_all(request);
    } else if (auto solution = arm.solve(request)) {
      solutions.push_back(std::move(*solution));
    }
    if (solutions.empty()) {
      const IkFailure failure = explain(arm, request);
      why = describe(arm, request, failure);
      solutions.push_back(failure.nearest);
    }
    for (const IkSolution& solution : solutions) {
      arm.chain().apply(model, solution.u, q);
      found.push_back(q);
    }
  }
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(found.size()), model.nq);
  for (std::size_t i = 0; i < found.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) = found[i].transpose();
  return py::make_tuple(to_matrix(rows), why);
}

py::dict finding_dict(const Finding& finding) {
  py::dict out =
      to_dict(Diagnostic{finding.severity, finding.rule, finding.message, finding.where, finding.fix});
  out["subject"] = finding.subject;
  out["consequence"] = finding.consequence.empty() && find_rule(finding.rule) != nullptr
                           ? std::string(find_rule(finding.rule)->failure)
                           : finding.consequence;
  out["repairable"] = !finding.repair.empty();
  return out;
}

py::list check(const DescribedModel& self) {
  AuditReport report;
  {
    const py::gil_scoped_release released;
    OpenedTarget target = open_target(self.twin_target, self.twin_arguments, data_folder() / "robots");
    AuditOptions options;
    options.datasheet_folder = data_folder() / "datasheets";
    report = audit_target(target, options);
  }
  py::list out;
  for (const Finding& finding : report.findings) out.append(finding_dict(finding));
  return out;
}

py::dict joint_dict(const Model& model, const ModelJoint& joint) {
  const auto link = [&model](int index) { return model.links[static_cast<std::size_t>(index)].name; };
  py::dict out;
  out["name"] = joint.name;
  out["type"] = kJointTypes[static_cast<std::size_t>(joint.type)];
  out["parent"] = link(joint.parent_link);
  out["child"] = link(joint.child_link);
  out["axis"] = to_array(Eigen::VectorXd(joint.axis));
  out["q_index"] = joint.q;
  out["nq"] = joint.nq;
  out["v_index"] = joint.v;
  out["nv"] = joint.nv;
  out["lower"] = joint.lower;
  out["upper"] = joint.upper;
  out["effort"] = joint.effort;
  out["velocity"] = joint.velocity;
  out["damping"] = joint.damping;
  out["friction"] = joint.friction;
  const bool mimics = joint.mimics();
  out["mimics"] = mimics
                      ? py::object(py::str(model.joints[static_cast<std::size_t>(joint.mimic_leader)].name))
                      : py::none();
  out["multiplier"] = joint.mimic_multiplier;
  out["offset"] = joint.mimic_offset;
  return out;
}

py::dict link_dict(const Model& model, const ModelLink& link) {
  py::dict out;
  out["name"] = link.name;
  out["joint"] = link.joint < 0
                     ? py::none()
                     : py::object(py::str(model.joints[static_cast<std::size_t>(link.joint)].name));
  const MassProperties body = link.inertia.value_or(MassProperties{});
  out["mass"] = body.mass;
  out["com"] = to_array(Eigen::VectorXd(body.com));
  out["inertia"] = to_matrix(body.I);
  return out;
}

std::shared_ptr<DescribedModel> load(const std::string& source, const py::dict& arguments,
                                     const std::string& overlay, bool floating) {
  XacroArguments given_arguments = to_arguments(arguments);
  const py::gil_scoped_release released;
  return load_model(source, std::move(given_arguments), overlay,
                    floating ? BaseKind::floating : BaseKind::fixed);
}

template <class List, class Make>
py::list list_of(const List& values, Make make) {
  py::list out;
  for (const auto& value : values) out.append(make(value));
  return out;
}

}  // namespace

void bind_model(py::module_& module) {
  py::class_<DescribedModel, std::shared_ptr<DescribedModel>>(module, "DescribedModel")
      .def_property_readonly("name", [](const DescribedModel& self) { return self.model->name; })
      .def_property_readonly("file", [](const DescribedModel& self) { return self.file.string(); })
      .def_property_readonly("nq", [](const DescribedModel& self) { return self.model->nq; })
      .def_property_readonly("nv", [](const DescribedModel& self) { return self.model->nv; })
      .def_property_readonly("mass", [](const DescribedModel& self) { return self.model->total_mass; })
      .def_property_readonly("diagnostics",
                             [](const DescribedModel& self) { return to_list(self.diagnostics); })
      .def("joints",
           [](const DescribedModel& self) {
             return list_of(self.model->joints,
                            [&](const auto& joint) { return joint_dict(*self.model, joint); });
           })
      .def("links",
           [](const DescribedModel& self) {
             return list_of(self.model->links,
                            [&](const auto& link) { return link_dict(*self.model, link); });
           })
      .def("driven", [](const DescribedModel& self) { return self.model->driven_joint_names(); })
      .def("neutral", [](const DescribedModel& self) { return to_array(self.model->neutral()); })
      .def("fk", &fk)
      .def("jacobian", &jacobian_of)
      .def("rnea", &rnea)
      .def("mass_matrix", &mass_matrix_of)
      .def("gravity", &gravity_of)
      .def("random_configurations", &random_configurations)
      .def("collisions", &collisions)
      .def("distance", &distance)
      .def("ik",
           [](const DescribedModel& self, const Numbers& target, const Numbers& seed, const std::string& tip,
              const std::string& base, const std::string& task, double position_tolerance,
              double rotation_tolerance, bool all) {
             return ik(self, target, seed, {tip, base, task, position_tolerance, rotation_tolerance, all});
           })
      .def("check", &check);
  module.def("load_model", &load);
  module.def("did_you_mean", [](const std::string& name, const std::vector<std::string>& candidates) {
    return did_you_mean(name, candidates);
  });
  module.attr("IK_POSITION_TOLERANCE") = kIkPositionTolerance;
  module.attr("IK_ROTATION_TOLERANCE") = kIkRotationTolerance;
}

}  // namespace doppel::python
