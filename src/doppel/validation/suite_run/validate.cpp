#include "doppel/validation/suite_run/validate.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <optional>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/parallel_work.h"
#include "doppel/base/core/text.h"
#include "doppel/base/core/thrown.h"
#include "doppel/validation/extras/contact_extra.h"
#include "doppel/validation/extras/kinematics_extra.h"
#include "doppel/validation/extras/path_extra.h"
#include "doppel/validation/extras/payload_extra.h"
#include "doppel/validation/extras/pose_extras.h"
#include "doppel/validation/extras/response_extra.h"
#include "doppel/validation/extras/sag_extra.h"
#include "doppel/validation/extras/singularity_extra.h"
#include "doppel/validation/extras/stopping_extra.h"
#include "doppel/validation/motions/drop_test.h"
#include "doppel/validation/motions/limit_enforcement.h"
#include "doppel/validation/motions/running_gates.h"
#include "doppel/validation/motions/step_response.h"
#include "doppel/validation/statics/audit_gates.h"
#include "doppel/validation/statics/file_gates.h"
#include "doppel/validation/statics/reachability.h"
#include "doppel/validation/statics/self_collision_sweep.h"
#include "doppel/validation/statics/sensor_coverage.h"
#include "doppel/validation/statics/shape_gates.h"

namespace doppel {
namespace {

using Clock = std::chrono::steady_clock;

// The function of a check, and what has to be there before: a machine that loads, and one whose controllers
// are active. A gate that is a test has no function.
struct Runner {
  std::string_view id;
  CheckResult (*run)(const CheckContext&) = nullptr;
  enum class Needs { files, machine, controllers } needs = Needs::machine;
  double weight = 1;    // of its time, about
  bool splits = false;  // its work, over all threads
  std::string_view test = {};
};

// Long ones first, so that threads end together; those that split their work run one after the other.
const std::vector<Runner>& runners() {
  using Needs = Runner::Needs;
  static const std::vector<Runner> kRunners = {
      {"G01", check_origin, Needs::files},
      {"G02", check_parsing, Needs::files},
      {"G09", check_controllers, Needs::machine},
      {"T1", check_reachability, Needs::machine, 20, true},
      {"T3", check_self_collision, Needs::machine, 20, true},
      {"T2", check_limit_enforcement, Needs::controllers, 10, true},
      {"T4", check_step_response, Needs::controllers, 10},
      {"G11", check_holding, Needs::controllers, 6},
      {"T6", check_drop, Needs::machine, 4},
      {"T5", check_sensor_coverage, Needs::machine, 2},
      {"G03", check_tree, Needs::machine},
      {"G04", check_inertias, Needs::machine},
      {"G05", check_collision_shapes, Needs::machine},
      {"G06", check_limits, Needs::machine},
      {"G07", check_motion_ranges, Needs::machine},
      {"G08", check_transforms, Needs::controllers, 2},
      {"G10", check_start, Needs::controllers},
      {"X2", check_frequency_response, Needs::controllers, 10},
      {"X3", check_pose_accuracy, Needs::controllers, 10},
      {"X5", check_paths, Needs::controllers, 10},
      {"X9", check_stopping, Needs::controllers, 10},
      {"X7", check_sag, Needs::machine, 4},
      {"X6", check_payload, Needs::machine, 4},
      {"X10", check_contact, Needs::machine, 2},
      {"X11", check_singularities, Needs::machine, 4},
      {"X1", check_kinematics, Needs::machine, 2},
      // They have the cycles of X3, and would wait for them.
      {"X4", check_pose_approach, Needs::controllers, 10},
      {"X8", check_power, Needs::controllers, 1},
      {"G12", nullptr, Needs::machine, 0, false, "T1"},
      {"G13", nullptr, Needs::machine, 0, false, "T2"},
      {"G14", nullptr, Needs::machine, 0, false, "T3"},
      {"G15", nullptr, Needs::machine, 0, false, "T6"},
  };
  return kRunners;
}

class Validation {
 public:
  Validation(const Subject& subject, const Suite& suite, const ValidationOptions& options)
      : subject_(subject), suite_(suite), options_(options) {
    for (const Runner& runner : runners()) {
      if (is_chosen(runner)) chosen_.push_back(&runner);
    }
    for (const Runner* runner : chosen_) all_ += runner->weight;
  }

  ValidationReport run() {
    const auto begin = Clock::now();
    deadline_ = options_.max_seconds > 0
                    ? std::optional(begin + std::chrono::duration_cast<Clock::duration>(
                                                std::chrono::duration<double>(options_.max_seconds)))
                    : std::nullopt;
    run_first();
    std::vector<const Runner*> rest;
    for (const Runner* runner : chosen_) {
      if (results_.contains(runner->id) || !runner->test.empty()) continue;
      if (runner->splits)
        run_one(*runner);
      else
        rest.push_back(runner);
    }
    parallel_work(rest.size(), options_.jobs, [&] { return [&](std::size_t i) { run_one(*rest[i]); }; });
    for (const Runner* runner : chosen_) {
      if (!runner->test.empty()) mirror(*runner);
    }
    ValidationReport out;
    out.robot = subject_.name;
    out.engine = subject_.scenario.engine;
    out.seed = options_.seed;
    out.effort = options_.effort;
    out.suite = suite_.file.string();
    out.files = subject_.files;
    out.strict = options_.strict;
    out.complete = !cancelled_;
    for (const CheckInfo& info : check_table()) {
      const auto found = results_.find(info.id);
      if (found != results_.end()) out.checks.push_back(std::move(found->second));
    }
    for (auto& [waiver, note] : ended_waivers_) out.notes.push_back(std::move(note));
    report_unused_waivers(out);
    out.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    return out;
  }

 private:
  [[nodiscard]] bool is_chosen(const Runner& runner) const {
    const auto has = [this](std::string_view id) {
      return std::ranges::find(options_.only, id) != options_.only.end();
    };
    if (has(runner.id)) return true;
    if (options_.only.empty())
      return find_check(runner.id)->kind != CheckKind::extra || options_.effort == Effort::full;
    // A gate that is a test runs it.
    return std::ranges::any_of(runners(),
                               [&](const Runner& gate) { return gate.test == runner.id && has(gate.id); });
  }

  // Runs first what other checks need: whether the machine loads, and whether its controllers start.
  void run_first() {
    for (const std::string_view id : {"G01", "G02"}) {
      const Runner& runner = *std::ranges::find(runners(), id, &Runner::id);
      if (std::ranges::find(chosen_, &runner) != chosen_.end()) run_one(runner);
    }
    if (!subject_.refusal.empty()) return;
    const Runner& controllers = *std::ranges::find(runners(), "G09", &Runner::id);
    const bool is_needed = std::ranges::any_of(
        chosen_, [](const Runner* runner) { return runner->needs == Runner::Needs::controllers; });
    if (!is_needed && std::ranges::find(chosen_, &controllers) == chosen_.end()) return;
    CheckResult result = run_guarded(controllers);
    controllers_start_ = std::ranges::none_of(
        result.items, [](const CheckItem& item) { return item.subject == kStartFailed; });
    if (std::ranges::find(chosen_, &controllers) != chosen_.end()) finish(controllers, std::move(result));
  }

  [[nodiscard]] std::string obstacle(const Runner& runner) const {
    if (runner.needs != Runner::Needs::files && !subject_.refusal.empty()) return "not run: G02";
    if (runner.needs == Runner::Needs::controllers && !controllers_start_) return "not run: G09";
    if (deadline_ && Clock::now() > *deadline_) return "not run: the time is over";
    return "";
  }

  CheckResult run_guarded(const Runner& runner) {
    CheckContext context{subject_, suite_};
    context.effort = options_.effort;
    context.seed = options_.seed;
    context.threads = runner.splits ? options_.jobs : 1;
    context.joint = options_.joint;
    context.shared = &shared_;
    context.record = options_.record;
    context.write_answers = options_.write_answers;
    context.progress = [this, &runner](double done) { return advance(runner, done); };
    CheckResult out = begin_result(runner.id);
    const auto begin = Clock::now();
    try {
      out = runner.run(context);
    } catch (const CheckCancelled&) {
      cancelled_ = true;
      out.verdict = Verdict::not_run;
      out.summary = "not run: it was ended";
    } catch (const InputError& error) {
      for (const Diagnostic& diagnostic : error.diagnostics())
        out.fail(kStartFailed, fmt::format("{} [{}]", diagnostic.message, diagnostic.rule), diagnostic.fix,
                 diagnostic.where);
      out.summary = "the twin does not start";
    } catch (...) {
      out.fail("", thrown_text());
      out.summary = "the check itself failed";
    }
    out.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    std::ranges::stable_sort(out.items, std::greater(), &CheckItem::verdict);
    return out;
  }

  void run_one(const Runner& runner) {
    const std::string why = cancelled_ ? "not run: it was ended" : obstacle(runner);
    if (why.empty()) return finish(runner, run_guarded(runner));
    CheckResult out = begin_result(runner.id);
    out.verdict = Verdict::not_run;
    out.summary = why;
    finish(runner, std::move(out));
  }

  void finish(const Runner& runner, CheckResult result) {
    static_cast<void>(advance(runner, 1));
    const std::lock_guard lock(mutex_);
    waive(result);
    if (options_.on_result) options_.on_result(result);
    results_.emplace(std::string(runner.id), std::move(result));
  }

  bool advance(const Runner& runner, double done) {
    const std::lock_guard lock(mutex_);
    double& part = done_[runner.id];
    part = std::max(part, runner.weight * std::clamp(done, 0.0, 1.0));
    if (cancelled_) return false;
    double sum = 0;
    for (const auto& [id, one] : done_) sum += one;
    if (options_.progress && !options_.progress(sum / all_, std::string(runner.id))) cancelled_ = true;
    return !cancelled_;
  }

  // A gate whose test is run.
  void mirror(const Runner& runner) {
    const auto test = results_.find(runner.test);
    if (test == results_.end()) return;
    CheckResult out = begin_result(runner.id);
    out.verdict = test->second.verdict;
    out.summary = fmt::format("{}: {}", runner.test, test->second.summary);
    finish(runner, std::move(out));
  }

  // Failures that the suite accepts, until a date.
  void waive(CheckResult& result) {
    for (std::size_t i = 0; i < suite_.waivers.size(); ++i) {
      const Waiver& waiver = suite_.waivers[i];
      if (waiver.check != result.id) continue;
      const bool is_over = !waiver.until.empty() && options_.today > waiver.until;
      bool is_used = false;
      for (CheckItem& item : result.items) {
        const bool matches = waiver.subject.empty() || item.subject.find(waiver.subject) != std::string::npos;
        if (item.verdict != Verdict::failed || !matches) continue;
        is_used = true;
        if (is_over) continue;
        item.verdict = Verdict::waived;
        item.message += fmt::format("; waived: {}{}", waiver.why,
                                    waiver.until.empty() ? "" : " (until " + waiver.until + ")");
      }
      if (is_used) used_waivers_.push_back(i);
      if (is_used && is_over)
        ended_waivers_[i] =
            fmt::format("the waiver of {} ended on {}: {}", waiver.check, waiver.until, waiver.why);
    }
    if (result.verdict != Verdict::failed || result.items.empty()) return;
    Verdict worst = Verdict::not_applicable;
    for (const CheckItem& item : result.items) worst = std::max(worst, item.verdict);
    result.verdict = worst;
  }

  void report_unused_waivers(ValidationReport& out) const {
    for (std::size_t i = 0; i < suite_.waivers.size(); ++i) {
      const bool ran = results_.contains(suite_.waivers[i].check);
      if (ran && std::ranges::find(used_waivers_, i) == used_waivers_.end())
        out.notes.push_back(fmt::format("{}: the waiver of {} is not needed", suite_.waivers[i].where.place(),
                                        suite_.waivers[i].check));
    }
  }

  static constexpr const char* kStartFailed = "the start";
  const Subject& subject_;
  const Suite& suite_;
  const ValidationOptions& options_;
  SharedResults shared_;
  std::vector<const Runner*> chosen_;
  double all_ = 0;
  bool controllers_start_ = true;
  std::optional<Clock::time_point> deadline_;
  std::atomic<bool> cancelled_{false};
  std::mutex mutex_;
  std::map<std::string_view, double> done_;
  std::map<std::string, CheckResult, std::less<>> results_;
  std::vector<std::size_t> used_waivers_;
  std::map<std::size_t, std::string> ended_waivers_;  // notes, by the index of the waiver
};

}  // namespace

ValidationReport validate(const Subject& subject, const Suite& suite, const ValidationOptions& options) {
  return Validation(subject, suite, options).run();
}

std::vector<std::string> check_ids(const std::vector<std::string>& words) {
  std::vector<std::string> names = {"gates", "tests", "extras"}, out;
  for (const CheckInfo& info : check_table()) names.emplace_back(info.id);
  for (const std::string& word : words) {
    bool any = false;
    for (const CheckInfo& info : check_table()) {
      const bool is_group = (word == "gates" && info.kind == CheckKind::gate) ||
                            (word == "tests" && info.kind == CheckKind::test) ||
                            (word == "extras" && info.kind == CheckKind::extra);
      if (!is_group && lowered(info.id) != lowered(word)) continue;
      out.emplace_back(info.id);
      any = true;
    }
    if (!any)
      throw InputError("cli.use", {},
                       fmt::format("'{}' is no gate, test or extra{}", word, did_you_mean(word, names)),
                       "gates are G01 to G15, tests T1 to T6, extras X1 to X11");
  }
  return out;
}

}  // namespace doppel
