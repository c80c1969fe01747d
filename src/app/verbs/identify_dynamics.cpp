// doppel identify dynamics TARGET --recording BAG: inertias and friction of an arm with recorded efforts.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/hardware_target.h"
#include "app/verbs/identify.h"
#include "app/verbs/identify_fits.h"
#include "app/verbs/shell.h"
#include "doppel/base/core/names.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/physics/contract/described_servo.h"
#include "doppel/review/identification/inertia_operation.h"
#include "doppel/review/identification/inverse_model.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel::app {
namespace {

using Json = nlohmann::ordered_json;

const Eigen::Vector3d kDownwards(0, 0, -9.81);

struct DynamicsVerb {
  std::vector<std::string> words;
  std::string recording;
  PayloadWords payload;
  bool json = false, write = false, yes = false, all = false;
};

struct DynamicsFit {
  DescriptionTarget target;
  RobotDescription robot;
  Model model;
  InverseModel fit;
};

const char* verdict_text(BaseVerdict verdict) {
  switch (verdict) {
    case BaseVerdict::identified:
      return "identified";
    case BaseVerdict::zero:
      return "small: the interval is wide beside the value";
    case BaseVerdict::not_excited:
      break;
  }
  return "not identifiable, because the motion does not excite it";
}

DynamicsFit fit_dynamics(const DynamicsVerb& verb) {
  DynamicsFit out{open_target(verb.words), {}, {}, {}};
  out.robot = load_target(out.target).robot;
  Diagnostics diagnostics;
  const Model model = compile_model(out.robot, BaseKind::fixed, diagnostics);
  print_diagnostics(diagnostics);
  std::optional<Payload> payload = recorded_payload(verb.recording);
  if (const std::optional<Payload> carried = payload_of(verb.payload)) payload = carried;
  out.model = payload ? loaded_model(model, *payload) : model;
  if (payload)
    print_note(fmt::format("note: with {:.4g} kg at '{}', which is no part of what is written", payload->mass,
                           payload_link(model, *payload)));
  BagReader bag(verb.recording);
  const TorqueRecord record = torque_record(out.model, read_recorded_motion(bag));
  const std::vector<ServoParameters> servos = choose_servos(out.robot, model, ServoOptions{}, kDownwards);
  std::vector<DriveLosses> losses;
  for (const int drive : record.drives) {
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(drive)];
    losses.push_back({servos[static_cast<std::size_t>(drive)].armature, joint.damping, joint.friction});
  }
  out.fit = fit_inverse_model(out.model, record, losses, kDownwards);
  // The weight is taken off again.
  if (payload) {
    const int link = model.find_link(payload_link(model, *payload));
    for (FittedLink& one : out.fit.links) {
      if (one.link == link) remove_payload(one, *payload, model.links[static_cast<std::size_t>(link)]);
    }
    out.model = model;
  }
  return out;
}

// -- text

std::string dynamics_text(const DynamicsFit& one, bool all) {
  const InverseModel& fit = one.fit;
  std::string out = fmt::format(
      "{}: {} samples; {} parameters act in {} combinations, {} of them identified\n", one.robot.name,
      fit.samples, fit.parameters, fit.base.size(), fit.count(BaseVerdict::identified));
  out += fmt::format("  {:>11}  {:<26}{:>11}  {}\n", "value", "95 % interval", "described", "combination");
  for (const BaseParameter& base : fit.base) {
    if (!all && base.verdict != BaseVerdict::identified) continue;
    out += fmt::format(
        "  {:>11.4g}  {:<26}{:>11.4g}  {}{}\n", base.value,
        fmt::format("{:.4g} to {:.4g}", base.low, base.high), base.described, base.name,
        base.verdict == BaseVerdict::identified ? "" : fmt::format(" ({})", verdict_text(base.verdict)));
  }
  if (!all && fit.count(BaseVerdict::identified) < static_cast<int>(fit.base.size())) {
    out += fmt::format("  {} small, {} not excited by the motion: --all shows them\n",
                       fit.count(BaseVerdict::zero), fit.count(BaseVerdict::not_excited));
  }
  out += "held-out efforts, rms in N m or N:\n";
  out += fmt::format("  {:>10}{:>12}{:>14}{:>12}  {}\n", "effort", "described", "combinations", "bodies",
                     "joint");
  for (const TorqueErrors& error : fit.errors)
    out +=
        fmt::format("  {:>10.4g}{:>12.4g}{:>14.4g}{:>12.4g}  {}\n", error.effort, error.described, error.base,
                    error.physical, error.samples > 0 ? error.joint : error.joint + " (it stands)");
  out += "bodies that can exist, nearest to the described ones:\n";
  for (const FittedLink& link : fit.links) {
    const MassProperties &was = link.described, &now = link.fitted;
    out += fmt::format(
        "  '{}': {:.4g} kg (was {:.4g}), centre of mass {:.4f} {:.4f} {:.4f} m (was {:.4f} {:.4f} {:.4f})\n",
        one.model.links[static_cast<std::size_t>(link.link)].name, now.mass, was.mass, now.com.x(),
        now.com.y(), now.com.z(), was.com.x(), was.com.y(), was.com.z());
  }
  if (!fit.is_better()) out += "warning: the described bodies predict the held-out efforts as well\n";
  return out;
}

Json dynamics_json(const DynamicsFit& one, const std::string& recording) {
  Json out{{"version", 1},
           {"robot", one.robot.name},
           {"recording", recording},
           {"samples", one.fit.samples},
           {"parameters", one.fit.parameters},
           {"inflation", one.fit.inflation},
           {"better", one.fit.is_better()}};
  for (const BaseParameter& base : one.fit.base)
    out["combinations"].push_back({{"name", base.name},
                                   {"value", base.value},
                                   {"low", base.low},
                                   {"high", base.high},
                                   {"described", base.described},
                                   {"assessment", verdict_text(base.verdict)}});
  for (const TorqueErrors& error : one.fit.errors)
    out["held_out"].push_back({{"joint", error.joint},
                               {"effort", error.effort},
                               {"described", error.described},
                               {"combinations", error.base},
                               {"bodies", error.physical},
                               {"samples", error.samples}});
  for (const FittedLink& link : one.fit.links) {
    const MassProperties& now = link.fitted;
    out["links"].push_back(
        {{"link", one.model.links[static_cast<std::size_t>(link.link)].name},
         {"mass", now.mass},
         {"com", {now.com.x(), now.com.y(), now.com.z()}},
         {"inertia", {now.I(0, 0), now.I(0, 1), now.I(0, 2), now.I(1, 1), now.I(1, 2), now.I(2, 2)}}});
  }
  for (const FittedDrive& drive : one.fit.drives) {
    out["drives"].push_back({{"joint", one.model.joints[static_cast<std::size_t>(drive.joint)].name},
                             {"armature", drive.fitted.armature},
                             {"viscous", drive.fitted.viscous},
                             {"friction", drive.fitted.friction}});
  }
  return out;
}

// -- the overlay

bool write_dynamics(const DynamicsVerb& verb, DynamicsFit& one) {
  if (!one.fit.is_better()) {
    print_note("nothing is written: the described bodies predict the held-out efforts as well");
    return false;
  }
  std::vector<Operation> operations = dynamics_operations(one.robot, one.model, one.fit);
  Diagnostics diagnostics;
  const ExpandedDescription corrected =
      expand_corrected(one.target.target.description, one.target.arguments, one.target.resolver, diagnostics);
  const std::string evidence = recording_evidence({verb.recording});
  std::string question;
  for (Operation& operation : operations) {
    operation.evidence.insert(operation.evidence.begin(), evidence);
    take_fingerprint(operation, corrected);
    question += fmt::format("  {}\n", describe(operation.action));
  }
  const auto file = overlay_path(one.target.target.description);
  if (!confirmed(fmt::format("{}Write this to {}?", question, file.string()), verb.yes)) return false;
  print_line("wrote {} operations to {}\n", operations.size(),
             add_to_overlay(one.target.target.description, operations).string());
  return true;
}

int run_dynamics(const DynamicsVerb& verb) {
  DynamicsFit one = fit_dynamics(verb);
  deliver(verb.json ? dynamics_json(one, verb.recording).dump(2) + "\n" : dynamics_text(one, verb.all));
  if (verb.write) return write_dynamics(verb, one) ? 0 : 1;
  return one.fit.count(BaseVerdict::identified) > 0 ? 0 : 1;
}

}  // namespace

void add_identify_dynamics(CLI::App& group, int& exit_code) {
  const auto options = std::make_shared<DynamicsVerb>();
  CLI::App* verb = group.add_subcommand(
      "dynamics", "Masses, inertias and friction of an arm whose efforts are recorded, with intervals");
  add_target(*verb, options->words);
  verb->add_option("--recording", options->recording, "The bag, with efforts in joint_states")
      ->required()
      ->type_name("BAG");
  add_payload_options(*verb, options->payload,
                      "The known weight in the recording, where it does not name it");
  verb->add_flag("--all", options->all, "Print also what could not be identified");
  verb->add_flag("--json", options->json, "Print a JSON object to stdout, in kg, m, N m");
  CLI::Option* const write = verb->add_flag(
      "--write", options->write, "Write the bodies to the overlay (set_inertia), after a question");
  verb->add_flag("-y,--yes", options->yes, "Answer the question with yes")->needs(write);
  verb->footer(
      "All joints should move, also together: doppel bag record --all, or doppel identify record.\n"
      "Exit code 1: nothing could be identified, or with --write nothing was written.\n"
      "Examples:\n  doppel identify dynamics kate --recording motions\n"
      "  doppel identify dynamics my_arm.urdf.xacro --recording run.mcap --write\n"
      "See doppel man identification.md");
  verb->callback([options, &exit_code] { exit_code = run_dynamics(*options); });
}

}  // namespace doppel::app
