// doppel identify fit TARGET --recording BAG: the servos of the recorded joints, with intervals.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/hardware_target.h"
#include "app/verbs/identify.h"
#include "app/verbs/identify_fits.h"
#include "app/verbs/interruptible_work.h"
#include "app/verbs/shell.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/review/identification/servo_operation.h"

namespace doppel::app {
namespace {

using Json = nlohmann::ordered_json;

struct FitVerb {
  FitRequest request;
  bool json = false, write = false, accept = false, yes = false;
};

Json fit_json(const JointFit& one) {
  const ServoFit& fit = one.fit;
  Json out{{"joint", one.joint},         {"samples", one.record.time.size()},
           {"seconds", one.seconds},     {"releases", one.record.released.size()},
           {"model", name_of(fit.rung)}, {"values", Json::object()}};
  for (const ServoQuantity quantity : fitted_quantities(fit)) {
    const FittedValue& value = fit[quantity];
    out["values"][std::string(name_of(quantity))] = {{"value", value.value},
                                                     {"low", value.low},
                                                     {"high", value.high},
                                                     {"unit", unit_of(quantity, one.slides)},
                                                     {"start", one.start[static_cast<std::size_t>(quantity)]},
                                                     {"identified", fit.is_identified(quantity)},
                                                     {"trusted", fit.is_trusted(quantity)},
                                                     {"assessment", assessment(fit, quantity)}};
  }
  out["correlated"] = Json::array();
  for (const CorrelatedPair& pair : fit.correlated)
    out["correlated"].push_back(
        {{"a", name_of(pair.a)}, {"b", name_of(pair.b)}, {"correlation", pair.correlation}});
  out["residuals"] = {{"rms", fit.rms},
                      {"held_out_rms", fit.held_out_rms},
                      {"tick", fit.tick},
                      {"structure", fit.structure},
                      {"white_probability", fit.white_probability}};
  out["warnings"] = fit.warnings;
  return out;
}

// -- the overlay

// One for each joint with values that may be written; the others are printed.
std::vector<Operation> operations_of(const FitVerb& verb, RecordingFits& fits) {
  const std::string evidence = recording_evidence(verb.request.recordings);
  Diagnostics diagnostics;
  const ExpandedDescription corrected = expand_corrected(
      fits.target.target.description, fits.target.arguments, fits.target.resolver, diagnostics);
  std::vector<Operation> out;
  for (const JointFit& one : fits.joints) {
    const ServoWriting writing = servo_operation(one.joint, one.fit, verb.accept);
    for (const std::string& left : writing.left_out) print_note(fmt::format("{}: {}", one.joint, left));
    if (!writing.operation) continue;
    Operation operation;
    operation.action = *writing.operation;
    operation.why =
        fmt::format("identified from {:.0f} s of motion, model {}", one.seconds, name_of(one.fit.rung));
    operation.evidence = {evidence, writing.evidence};
    take_fingerprint(operation, corrected);
    out.push_back(std::move(operation));
  }
  return out;
}

// True: nothing stopped it.
bool write_servos(const FitVerb& verb, RecordingFits& fits) {
  const std::vector<Operation> operations = operations_of(verb, fits);
  if (operations.empty()) {
    print_note(verb.accept ? "nothing is written: no value is identified"
                           : "nothing is written: no value is trusted; --accept writes those that are "
                             "identified if the model fits");
    return false;
  }
  const auto file = overlay_path(fits.target.target.description);
  std::string question;
  for (const Operation& operation : operations) question += fmt::format("  {}\n", describe(operation.action));
  question = fmt::format("{}Write this to {}?", question, file.string());
  if (!confirmed(question, verb.yes)) return false;
  print_line("wrote {} servo{} to {}\n", operations.size(), operations.size() == 1 ? "" : "s",
             add_to_overlay(fits.target.target.description, operations).string());
  return true;
}

int run_fit(const FitVerb& verb) {
  std::optional<RecordingFits> fits = fit_recording(verb.request);
  if (!fits) return interrupted_without_output();
  Json json{{"version", 1},
            {"robot", fits->robot},
            {"recording", verb.request.recordings.back()},
            {"recordings", verb.request.recordings},
            {"joints", Json::array()}};
  std::string text;
  for (const JointFit& one : fits->joints) {
    json["joints"].push_back(fit_json(one));
    text += (text.empty() ? "" : "\n") + fit_table(one);
  }
  deliver(verb.json ? json.dump(2) + "\n" : text);
  if (verb.write) return write_servos(verb, *fits) ? 0 : 1;
  return std::ranges::any_of(fits->joints, [](const JointFit& one) { return has_result(one.fit); }) ? 0 : 1;
}

}  // namespace

void add_identify_fit(CLI::App& group, int& exit_code) {
  const auto options = std::make_shared<FitVerb>();
  CLI::App* verb = group.add_subcommand(
      "fit", "Stiffness, damping, friction, delay and limits of servos, with intervals, from a recording");
  add_fit_request(*verb, options->request);
  verb->add_flag("--json", options->json, "Print a JSON object to stdout, in s, rad, m, N m");
  CLI::Option* const write = verb->add_flag(
      "--write", options->write, "Write the trusted values to the overlay (set_servo), after a question");
  verb->add_flag("--accept", options->accept,
                 "Write also values that are identified only if the model fits: see the warnings")
      ->needs(write);
  verb->add_flag("-y,--yes", options->yes, "Answer the question with yes")->needs(write);
  verb->footer(
      "Exit code 1: nothing could be identified, or with --write nothing was written.\n"
      "Examples:\n  doppel identify fit omarm_one --recording motions\n"
      "  doppel identify fit omarm_one --recording motions --write\n"
      "  doppel identify fit omarm_one --recording motions --recording loaded --payload 200g@0,0,0.05\n"
      "  doppel identify fit my_arm.urdf.xacro --recording run.mcap --joint \"Revolute 2\" --json\n"
      "See doppel man identification.md");
  verb->callback([options, &exit_code] { exit_code = run_fit(*options); });
}

}  // namespace doppel::app
