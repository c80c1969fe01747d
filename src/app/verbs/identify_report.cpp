// doppel identify report TARGET --recording BAG: what a fit found, with measured and predicted curves.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>

#include "app/output.h"
#include "app/verbs/identify.h"
#include "app/verbs/identify_fits.h"
#include "app/verbs/interruptible_work.h"
#include "app/verbs/shell.h"
#include "doppel/base/xml/xml.h"
#include "doppel/lab/curve_plot/curve_plot.h"

namespace doppel::app {
namespace {

struct ReportVerb {
  FitRequest request;
  std::string output;
};

std::string escaped(std::string_view text) {
  return escape_xml(text, true);
}

// -- text

std::string residual_text(const JointFit& one) {
  const ServoFit& fit = one.fit;
  std::string out = "  ladder:";
  for (const RungResult& rung : fit.ladder)
    out += fmt::format(" {} {:.3g} (held out {:.3g}){}", name_of(rung.rung), 1e3 * rung.training_rms,
                       1e3 * rung.held_out_rms, rung.rung == fit.rung ? " kept" : "");
  out += one.slides ? " mm\n" : " mrad\n";
  out += fmt::format(
      "  whiteness: Ljung-Box {:.4g} over 10 lags of the samples in motion, probability {:.2g}; intervals "
      "are "
      "widened by the correlation of the residuals, variance x {:.3g}\n",
      fit.ljung_box, fit.white_probability, fit.inflation);
  out +=
      fmt::format("  limits: the velocity limit acts in {:.2g} %, the effort limit in {:.2g} % of the time\n",
                  100 * fit.velocity_share, 100 * fit.effort_share);
  for (const ServoQuantity bound : fit.at_bound)
    out += fmt::format("  {} is at the bound of the fit\n", name_of(bound));
  return out;
}

// -- HTML

std::string plot_of(const JointFit& one) {
  const JointRecord& record = one.record;
  std::vector<double> difference;
  for (std::size_t i = 0; i < record.time.size(); ++i)
    difference.push_back(1e3 * (record.position[i] - one.fit.predicted[i]));
  const char *unit = one.slides ? "m" : "rad", *small = one.slides ? "mm" : "mrad";
  PlotPanel position{
      "position",
      unit,
      {},
      {{"measured", record.time, record.position}, {"predicted", record.time, one.fit.predicted}}};
  PlotPanel residual{"measured - predicted",
                     small,
                     fmt::format("rms {:.3g} {}", 1e3 * one.fit.rms, small),
                     {{"difference", record.time, difference}}};
  if (one.fit.tick > 0) {
    residual.bands.push_back(
        {"half a tick", -500 * one.fit.tick, 500 * one.fit.tick, record.time.front(), record.time.back()});
  }
  return curve_plot(one.joint, fmt::format("model {}", name_of(one.fit.rung)), {position, residual});
}

std::string table_of(const JointFit& one) {
  std::string out =
      "<table><tr><th></th><th>value</th><th>95 % "
      "interval</th><th>unit</th><th>start</th><th>assessment</th></tr>\n";
  for (const ServoQuantity quantity : fitted_quantities(one.fit)) {
    const FittedValue& value = one.fit[quantity];
    out += fmt::format(
        "<tr><td>{}</td><td>{:.4g}</td><td>{:.4g} to {:.4g}</td><td>{}</td><td>{:.4g}</td><td>{}</td></tr>\n",
        name_of(quantity), value.value, value.low, value.high, unit_of(quantity, one.slides),
        one.start[static_cast<std::size_t>(quantity)], escaped(assessment(one.fit, quantity)));
  }
  return out + "</table>\n";
}

// The lines below a joint's table, as in the terminal.
std::string lines_of(const JointFit& one) {
  std::string text = fit_table(one);
  const std::size_t lines = fitted_quantities(one.fit).size() + 2;  // the title and the table's
  for (std::size_t i = 0; i < lines; ++i) text.erase(0, text.find('\n') + 1);
  return text + residual_text(one);
}

std::string page_of(const RecordingFits& fits, const std::string& evidence) {
  std::string out = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Servos of {0}</title>\n"
      "<style>body{{font:15px/1.5 sans-serif;max-width:70em;margin:2em auto;padding:0 1em}}"
      "table{{border-collapse:collapse}}td,th{{border-bottom:1px solid #ccc;padding:.2em "
      ".8em;text-align:left}}"
      "pre{{white-space:pre-wrap}}svg{{max-width:100%;height:auto}}</style></head><body>\n"
      "<h1>Servos of {0}</h1>\n<p>{1}</p>\n",
      escaped(fits.robot), escaped(evidence));
  for (const JointFit& one : fits.joints) {
    out += fmt::format("<h2>{}</h2>\n{}<pre>{}</pre>\n{}\n", escaped(one.joint), table_of(one),
                       escaped(lines_of(one)), plot_of(one));
  }
  return out + "</body></html>\n";
}

int run_report(const ReportVerb& verb) {
  if (!verb.output.empty()) check_output(verb.output);
  const std::optional<RecordingFits> fits = fit_recording(verb.request);
  if (!fits) return interrupted_without_output();
  if (!verb.output.empty()) {
    deliver(page_of(*fits, recording_evidence(verb.request.recordings)), verb.output);
    if (verb.output != "-") print_note(fmt::format("{}: {} joints", verb.output, fits->joints.size()));
  } else {
    std::string text = recording_evidence(verb.request.recordings) + "\n";
    for (const JointFit& one : fits->joints) text += "\n" + fit_table(one) + residual_text(one);
    deliver(text);
  }
  return std::ranges::any_of(fits->joints, [](const JointFit& one) { return has_result(one.fit); }) ? 0 : 1;
}

}  // namespace

void add_identify_report(CLI::App& group, int& exit_code) {
  const auto options = std::make_shared<ReportVerb>();
  CLI::App* verb = group.add_subcommand(
      "report", "Values, intervals, residuals and curves of a fit, in the terminal or as an HTML page");
  add_fit_request(*verb, options->request);
  verb->add_option("-o,--output", options->output, "An HTML page with the curves; - for stdout")
      ->type_name("FILE");
  verb->footer(
      "Exit code 1: nothing could be identified.\n"
      "Examples:\n  doppel identify report omarm_one --recording motions\n"
      "  doppel identify report omarm_one --recording motions -o servos.html\n"
      "See doppel man identification.md");
  verb->callback([options, &exit_code] { exit_code = run_report(*options); });
}

}  // namespace doppel::app
