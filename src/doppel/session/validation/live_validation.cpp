#include "doppel/session/validation/live_validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <mutex>
#include <optional>
#include <utility>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/validation/reports/html_report.h"
#include "doppel/validation/reports/report_formats.h"
#include "doppel/validation/reports/results.h"
#include "doppel/validation/suite_run/preparation.h"
#include "doppel/validation/suite_run/validate.h"

namespace doppel {
namespace {

using doppel_msgs::msg::CheckOutcome;
using doppel_msgs::srv::ListChecks;
using doppel_msgs::srv::Validate;

constexpr std::array<const char*, 3> kEfforts = {"quick", "standard", "full"};
constexpr std::array<const char*, 3> kKindNames = {"gate", "test", "extra"};

Effort effort_of(const std::string& word) {
  if (word.empty()) return Effort::standard;
  const auto found = std::ranges::find(kEfforts, word);
  if (found != kEfforts.end()) return static_cast<Effort>(found - kEfforts.begin());
  const std::vector<std::string> names(kEfforts.begin(), kEfforts.end());
  throw InputError("validate.effort", {},
                   fmt::format("there is no effort '{}'{}", word, did_you_mean(word, names)),
                   "write quick, standard or full");
}

std::vector<std::string> words_of(const Validate::Request& call) {
  return {call.only.begin(), call.only.end()};
}

CheckOutcome outcome_of(const CheckResult& result) {
  CheckOutcome out;
  out.id = result.id;
  out.title = result.title;
  out.verdict = verdict_key(result.verdict);
  out.summary = result.summary;
  out.seconds = result.seconds;
  return out;
}

// The values that clients have set act on the copy, too.
Scenario with_parameters(Scenario scenario, const std::vector<NamedParameter>& parameters) {
  for (const NamedParameter& parameter : parameters)
    scenario.ros.parameters.emplace_back(
        GivenParameter{parameter.node, parameter.name, parameter.value,
                       fmt::format("{}:{}:={}", parameter.node, parameter.name, to_string(parameter.value))});
  return scenario;
}

std::vector<std::string> sentences_about(const ValidationRequest& request, const Subject& subject,
                                         const Suite& suite) {
  std::vector<std::string> out = {fmt::format("a copy of {} from {}, as the files are now", subject.name,
                                              shown_path(subject.target.description))};
  for (const AppliedOverlay& overlay : subject.overlays)
    out.push_back(fmt::format("with the corrections of {}", shown_path(overlay.overlay.file)));
  out.push_back(suite.file.empty() ? "by the default limits: there is no validation/suite.yaml"
                                   : "by " + shown_path(suite.file.string()));
  out.push_back("physics: " + request.scenario.engine);
  std::string values;
  for (const NamedParameter& parameter : request.parameters)
    values += fmt::format("{}{}.{} = {}", values.empty() ? "" : ", ", parameter.node, parameter.name,
                          to_string(parameter.value));
  if (!values.empty()) out.push_back("with the parameters that were set since the start: " + values);
  out.emplace_back("alone on the ground: the running twin's pose, world and objects have no effect");
  return out;
}

class LiveValidation : public ValidationWork {
 public:
  explicit LiveValidation(LiveValidationOptions options) : options_(std::move(options)) {}

  [[nodiscard]] ListChecks::Response checks() const override {
    ListChecks::Response out;
    out.success = true;
    for (const CheckInfo& info : check_table()) {
      out.ids.emplace_back(info.id);
      out.titles.emplace_back(info.title);
      out.kinds.emplace_back(kKindNames[static_cast<std::size_t>(info.kind)]);
      out.decided_by.emplace_back(info.decided_by);
      out.limits.emplace_back(info.limit);
    }
    return out;
  }

  void check_words(const Validate::Request& call) const override {
    static_cast<void>(effort_of(std::string(call.effort)));
    static_cast<void>(check_ids(words_of(call)));
  }

  [[nodiscard]] std::string results() const override {
    const std::lock_guard lock(mutex_);
    return report_ ? to_json(shown(*report_), {.evidence = true}) : "";
  }

  [[nodiscard]] std::string report(const std::string& format, const std::string& page) const override {
    const auto [report, subject] = last();
    if (format.empty() || format == "html")
      return html_report(report, subject->model == nullptr ? nullptr : subject.get(), page);
    if (format == "json") return to_json(report);
    if (format == "junit") return to_junit(report);
    if (format == "sarif") return to_sarif(report);
    if (format == "markdown") return to_markdown(report);
    if (format == "text") return to_text(report, {});
    const std::vector<std::string> names = {"html", "json", "junit", "sarif", "markdown", "text"};
    throw InputError("validate.format", {},
                     fmt::format("there is no format '{}'{}", format, did_you_mean(format, names)),
                     "write html, json, junit, sarif, markdown or text");
  }

  std::string run(const ValidationRequest& request, const ValidationWatcher& watcher) override {
    {
      const std::lock_guard lock(mutex_);
      report_.reset();
      subject_.reset();
    }
    const auto subject = std::make_shared<const Subject>(
        read_subject(with_parameters(request.scenario, request.parameters),
                     {.datasheets = options_.bundled.datasheets, .datasheet = {}}));
    const Suite suite = suite_of(*subject, {});
    check_names(*subject, suite, std::string(request.call.joint));
    watcher.begins(sentences_about(request, *subject, suite));
    ValidationOptions how = options_of(request, watcher);
    begin_report(request, subject, suite, how);
    how.on_result = [this, &watcher](const CheckResult& result) {
      add(result);
      watcher.on_outcome(outcome_of(result));
    };
    ValidationReport whole = validate(*subject, suite, how);
    whole.target = request.scenario.robots.front().target;
    whole.version = options_.version;
    const std::lock_guard lock(mutex_);
    report_ = std::move(whole);
    has_ended_ = true;
    return headline(*report_);
  }

 private:
  [[nodiscard]] ValidationOptions options_of(const ValidationRequest& request,
                                             const ValidationWatcher& watcher) const {
    ValidationOptions out;
    out.effort = effort_of(std::string(request.call.effort));
    out.jobs = options_.jobs;
    out.only = check_ids(words_of(request.call));
    out.joint = request.call.joint;
    out.today = today();
    out.write_answers = false;
    out.progress = watcher.progress;
    return out;
  }

  // The report while its checks run.
  void begin_report(const ValidationRequest& request, const std::shared_ptr<const Subject>& subject,
                    const Suite& suite, const ValidationOptions& how) {
    ValidationReport report;
    report.robot = subject->name;
    report.target = request.scenario.robots.front().target;
    report.version = options_.version;
    report.engine = request.scenario.engine;
    report.effort = how.effort;
    report.suite = suite.file.string();
    report.files = subject->files;
    report.complete = false;
    const std::lock_guard lock(mutex_);
    report_ = std::move(report);
    subject_ = subject;
    has_ended_ = false;
  }

  // In the order of the table.
  void add(const CheckResult& result) {
    const auto place_of = [](const CheckResult& check) {
      return find_check(check.id) - check_table().data();
    };
    const std::lock_guard lock(mutex_);
    std::vector<CheckResult>& all = report_->checks;
    all.insert(std::ranges::upper_bound(all, place_of(result), {}, place_of), result);
  }

  static ValidationReport shown(ValidationReport report) {
    shorten_places(report, std::filesystem::current_path());
    return report;
  }

  [[nodiscard]] std::pair<ValidationReport, std::shared_ptr<const Subject>> last() const {
    const std::lock_guard lock(mutex_);
    if (!report_ || !has_ended_)
      throw InputError("validate.no_report", {}, "no validation has ended yet",
                       "start one: the Validate panel of the page, or /doppel/validate");
    return {shown(*report_), subject_};
  }

  LiveValidationOptions options_;
  mutable std::mutex mutex_;
  std::optional<ValidationReport> report_;
  std::shared_ptr<const Subject> subject_;
  bool has_ended_ = false;  // false: checks are still added to the report
};

}  // namespace

std::shared_ptr<ValidationWork> make_live_validation(LiveValidationOptions options) {
  return std::make_shared<LiveValidation>(std::move(options));
}

}  // namespace doppel
