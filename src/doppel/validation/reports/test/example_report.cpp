#include "doppel/validation/reports/test/example_report.h"

#include <cmath>

namespace doppel::reports_test {
namespace {

PlotPanel step_curve() {
  PlotPanel out;
  out.title = "Revolute 2";
  out.unit = "rad";
  out.remark = "overshoot 14.2 %, limit 10 %";
  PlotCurve measured{"position", {}, {}}, reference{"reference", {0, 0.1, 0.1, 1.5}, {0, 0, 0.5, 0.5}};
  for (int i = 0; i <= 700; ++i) {
    const double t = 0.002 * i;
    measured.times.push_back(0.1 + t);
    measured.values.push_back(0.5 * (1 - std::exp(-6 * t) * (std::cos(10 * t) + 0.6 * std::sin(10 * t))));
  }
  out.curves = {measured, reference};
  out.bands = {{"overshoot 10 %", -INFINITY, 0.55, 0.1, 1.5}, {"settled \u00b1 2 %", 0.49, 0.51, 0.6, 1.5}};
  return out;
}

CheckResult step_response() {
  CheckResult out = begin_result("T4");
  out.summary = "overshoot 14.2 % (limit 10 %) of Revolute 2";
  out.add(
      {.subject = "Revolute 2",
       .verdict = Verdict::failed,
       .message = "overshoot 14.2 % (limit 10 %), settling 0.62 s (limit 0.5 s): the drive is at its effort "
                  "limit for 38 % of the step",
       .fix = "lower the gain p of arm_controller from 40 to 25, or run: doppel tune omarm_one --write",
       .where = make_location("robots/omarm_one/config/controllers.yaml", 14, 7),
       .poses = {{"worst pose of gravity", {{"Revolute 1", 1.57}, {"Revolute 2", 1.2}, {"Revolute 3", 2.1}}}},
       .curves = {step_curve()}});
  out.add({.subject = "Revolute 3", .message = "overshoot 2.1 %, settling 0.31 s"});
  out.metrics = {{"overshoot", "Revolute 2", 14.2, "%", 10.0},
                 {"settling", "Revolute 2", 0.62, "s", 0.5},
                 {"overshoot", "Revolute 3", 2.1, "%", 10.0},
                 {"settling", "Revolute 3", 0.31, "s", 0.5},
                 {"saturated", "Revolute 2", 38, "%", {}, Metric::Better::neither}};
  return out;
}

CheckResult self_collision() {
  CheckResult out = begin_result("G14");
  out.summary = "1 pair that the SRDF disables collides, deepest 6.3 mm";
  out.add(
      {.subject = "base_link and link_4",
       .verdict = Verdict::failed,
       .message =
           "the SRDF says that they never collide, and they do in 12 of 10000 configurations, up to 6.3 mm",
       .fix = "remove the line from the SRDF, or limit Revolute 3 to 1.9 rad",
       .where = make_location("robots/omarm_one/srdf/omarm.srdf", 31, 3),
       .poses = {{"deepest overlap",
                  {{"Revolute 1", 0.4}, {"Revolute 2", 2.6}, {"Revolute 3", 2.9}, {"Revolute 4", 2.5}},
                  {"link_1_1", "link_4_1"}}}});
  out.metrics = {{"deepest overlap", "base_link and link_4", 0.0063, "m", 0.0}};
  return out;
}

std::vector<CheckResult> gates() {
  std::vector<CheckResult> out;
  out.push_back(begin_result("G01"));
  out.back().summary = "23 files, 1 overlay applied";
  out.push_back(begin_result("G03"));
  out.back().summary = "there is no validation/tree.txt";
  out.back().add({.subject = "",
                  .verdict = Verdict::not_judged,
                  .message = "validation/tree.txt was written from this description",
                  .fix = "read it, and commit it if the tree is as you designed it"});
  out.push_back(begin_result("G05"));
  out.back().summary = "4120 triangles (limit 2000) of base_link, waived";
  out.back().add({.subject = "base_link",
                  .verdict = Verdict::waived,
                  .message = "4120 triangles (limit 2000); accepted until 2027-06-01: scan of the real base",
                  .where = make_location("robots/omarm_one/urdf/omarm.xacro", 54, 5)});
  out.push_back(begin_result("G06"));
  out.back().summary = "0 errors, 1 warning";
  out.back().add({.subject = kHardName,
                  .verdict = Verdict::warned,
                  .message = "the effort limit 3.1 N m is above the datasheet's 2.7 N m",
                  .fix = "set effort=\"2.7\"",
                  .where = make_location("robots/omarm_one/urdf/omarm.xacro", 264, 3)});
  out.push_back(begin_result("G10"));
  out.back().summary = "first motion after 0.84 s (limit 2 s)";
  out.back().seconds = 1.3;
  out.back().metrics = {{"first motion", "", 0.84, "s", 2.0, Metric::Better::lower, true}};
  return out;
}

}  // namespace

ValidationReport example_report(const Subject* subject) {
  ValidationReport out;
  out.robot = "omarm";
  out.target = "omarm_one";
  out.version = "0.1.0";
  out.engine = "mujoco 2.2.2";
  out.suite = "robots/omarm_one/validation/suite.yaml";
  out.files = {{"robots/omarm_one/urdf/omarm.xacro", std::string(64, 'a')},
               {"robots/omarm_one/config/missing.yaml", kNoFile}};
  if (subject != nullptr) out.files = subject->files;
  out.checks = gates();
  out.checks.push_back(self_collision());
  CheckResult reachable = begin_result("T1");
  reachable.summary = "0.1 % of 1000 poses missed (limit 5 %)";
  reachable.metrics = {{"missed", "", 0.001, "", 0.05},
                       {"reached", "", 0.999, "", {}, Metric::Better::higher}};
  reachable.notes = {"position and direction alone: the arm has 5 joints"};
  out.checks.push_back(reachable);
  out.checks.push_back(step_response());
  out.checks.push_back(not_applicable("T5", "no sensor in the description"));
  CheckResult drop = begin_result("T6");
  drop.verdict = Verdict::not_run;
  drop.summary = "not run: G11";
  out.checks.push_back(drop);
  out.notes = {"the waiver of G05 expires on 2027-06-01"};
  out.seconds = 41.3;
  return out;
}

Subject bundled_subject(const char* robot) {
  Scenario scenario;
  scenario.robots.push_back({.target = robot});
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  return read_subject(scenario, {.datasheets = DOPPEL_SOURCE_DIR "/datasheets", .datasheet = {}});
}

}  // namespace doppel::reports_test
