#include "doppel/validation/reports/results.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/read_file.h"
#include "doppel/review/audit/report_places.h"
#include "doppel/validation/reports/detail/report_parts.h"
#include "doppel/validation/reports/html_report.h"
#include "doppel/validation/reports/report_formats.h"

namespace doppel {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 3> kBetter = {"neither", "lower", "higher"};
constexpr std::array<const char*, 3> kKinds = {"gate", "test", "extra"};

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json metric_json(const Metric& metric) {
  return {{"name", metric.name},
          {"subject", metric.subject},
          {"value", number(metric.value)},
          {"unit", metric.unit},
          {"limit", metric.limit ? number(*metric.limit) : Json(nullptr)},
          {"better", kBetter[static_cast<std::size_t>(metric.better)]}};
}

Json metrics_json(const CheckResult& check, bool wall_clock) {
  Json out = Json::array();
  for (const Metric& metric : check.metrics) {
    if (metric.wall_clock == wall_clock) out.push_back(metric_json(metric));
  }
  return out;
}

Json poses_json(const std::vector<PosedEvidence>& poses, bool with_command) {
  Json out = Json::array();
  for (const PosedEvidence& pose : poses) {
    Json joints = Json::object();
    for (const auto& [name, position] : pose.joints) joints[name] = number(position);
    out.push_back({{"caption", pose.caption}, {"joints", joints}, {"links", pose.links}});
    if (with_command) out.back()["command"] = move_command(pose);
  }
  return out;
}

// The indices of the points that are shown: all, or the least and the greatest value of equal parts.
std::vector<std::size_t> shown_points(const PlotCurve& curve) {
  const std::size_t count = std::min(curve.times.size(), curve.values.size());
  const std::size_t parts = count <= kMaxCurvePoints ? count : kMaxCurvePoints / 2;
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < parts; ++i) {
    const auto begin = static_cast<std::ptrdiff_t>(i * count / parts),
               end = static_cast<std::ptrdiff_t>((i + 1) * count / parts);
    const auto [least, most] = std::minmax_element(curve.values.begin() + begin, curve.values.begin() + end);
    const auto first = static_cast<std::size_t>(std::min(least, most) - curve.values.begin()),
               second = static_cast<std::size_t>(std::max(least, most) - curve.values.begin());
    out.push_back(first);
    if (second != first) out.push_back(second);
  }
  return out;
}

// Rounded, because a picture needs no more digits.
Json shown_number(double value) {
  return std::isfinite(value) ? Json(std::strtod(fmt::format("{:.6g}", value).c_str(), nullptr))
                              : Json(nullptr);
}

Json curve_json(const PlotCurve& curve) {
  Json x = Json::array(), y = Json::array();
  for (const std::size_t i : shown_points(curve)) {
    x.push_back(shown_number(curve.times[i]));
    y.push_back(shown_number(curve.values[i]));
  }
  return {{"label", curve.label}, {"x", x}, {"y", y}};
}

Json panels_json(const std::vector<PlotPanel>& panels) {
  Json out = Json::array();
  for (const PlotPanel& panel : panels) {
    Json curves = Json::array(), bands = Json::array();
    for (const PlotCurve& curve : panel.curves) curves.push_back(curve_json(curve));
    for (const PlotBand& band : panel.bands)
      bands.push_back({{"label", band.label},
                       {"low", number(band.low)},
                       {"high", number(band.high)},
                       {"begin", number(band.begin)},
                       {"end", number(band.end)}});
    out.push_back({{"title", panel.title},
                   {"unit", panel.unit},
                   {"x_axis", panel.x_axis},
                   {"remark", panel.remark},
                   {"curves", curves},
                   {"bands", bands}});
  }
  return out;
}

Json item_json(const CheckItem& item, bool with_sentence, bool with_evidence) {
  Json out{{"subject", item.subject},
           {"verdict", verdict_key(item.verdict)},
           {"message", with_sentence ? item.message : ""},
           {"fix", item.fix},
           {"file", item.where.known() ? *item.where.file : ""},
           {"line", item.where.line},
           {"column", item.where.column},
           {"poses", poses_json(item.poses, with_evidence)},
           {"recording", item.recording.empty() ? Json(nullptr) : Json(item.recording)}};
  if (with_evidence) out["curves"] = panels_json(item.curves);
  return out;
}

Json check_json(const CheckResult& check, const ResultsOptions& options) {
  const bool with_sentences = options.wall_clock || std::ranges::none_of(check.metrics, &Metric::wall_clock);
  Json items = Json::array();
  for (const CheckItem& item : check.items)
    items.push_back(item_json(item, with_sentences, options.evidence));
  return {{"id", check.id},
          {"title", check.title},
          {"kind", kKinds[static_cast<std::size_t>(kind_of(check))]},
          {"verdict", verdict_key(check.verdict)},
          {"summary", with_sentences ? check.summary : ""},
          {"items", items},
          {"metrics", metrics_json(check, false)},
          {"notes", with_sentences ? check.notes : std::vector<std::string>()}};
}

Json timing_json(const ValidationReport& report) {
  Json checks = Json::array();
  for (const CheckResult& check : report.checks)
    checks.push_back(
        {{"id", check.id}, {"seconds", number(check.seconds)}, {"metrics", metrics_json(check, true)}});
  return {{"seconds", number(report.seconds)}, {"checks", checks}};
}

Json inputs_json(const ValidationReport& report) {
  Json out = Json::array();
  for (const ReadFile& file : report.files)
    out.push_back({{"file", file.file.string()},
                   {"sha256", file.sha256 == kNoFile ? Json(nullptr) : Json(file.sha256)}});
  return out;
}

Json regressions_json(const ValidationReport& report) {
  Json out = Json::array();
  for (const Regression& regression : report.regressions) {
    Json one{{"check", regression.check}};
    one.update(metric_json(regression.metric));
    one["before"] = number(regression.before);
    out.push_back(one);
  }
  return out;
}

Json counts_json(const ValidationReport& report) {
  Json out = Json::object();
  for (int i = 0; i <= static_cast<int>(Verdict::failed); ++i)
    out[verdict_key(static_cast<Verdict>(i))] = report.count(static_cast<Verdict>(i));
  return out;
}

// -- reading

double value_or_nan(const Json& json) {
  return json.is_number() ? json.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

Json parsed(const std::filesystem::path& file) {
  constexpr std::size_t kMaxResultsBytes = std::size_t{64} << 20;
  const FileContent content = read_content(file, kMaxResultsBytes);
  if (!content.was_read())
    throw InputError("baseline.unreadable", make_location(file.string()),
                     "the file cannot be read: " + content.problem,
                     "name the results.json of an earlier doppel validate --report");
  try {
    return Json::parse(content.bytes);
  } catch (const Json::parse_error& error) {
    const std::string& bytes = content.bytes;
    const std::size_t count = std::min(error.byte, bytes.size());
    const auto line = 1 + std::count(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count), '\n');
    throw InputError("baseline.not_json", make_location(file.string(), static_cast<int>(line)),
                     "the file is not JSON", "name the results.json of an earlier doppel validate --report");
  }
}

void require_version(const Json& json, const std::filesystem::path& file) {
  const SourceLocation where = make_location(file.string());
  if (!json.is_object() || !json.contains("schema_version") || !json["schema_version"].is_number_integer())
    throw InputError("baseline.not_results", where,
                     "the file has no 'schema_version': it is not a result of doppel validate",
                     "name the results.json of an earlier doppel validate --report");
  const auto version = json["schema_version"].get<std::int64_t>();
  if (version != kResultsVersion)
    throw InputError(
        "baseline.version", where,
        fmt::format("its schema has version {}, and this doppel reads version {}", version, kResultsVersion),
        "write the baseline again by doppel validate --report");
}

void add_metrics(const Json& check, Baseline& baseline) {
  for (const Json& metric : check.at("metrics"))
    baseline.metrics.push_back({check.at("id").get<std::string>(), metric.at("subject").get<std::string>(),
                                metric.at("name").get<std::string>(), metric.at("unit").get<std::string>(),
                                value_or_nan(metric.at("value"))});
}

// -- comparing

// The worsening of the metric as a share of the value before; negative: better.
double worsening(const Metric& now, double before) {
  const double sign = now.better == Metric::Better::lower ? 1 : -1;
  const double change = sign * (now.value - before);
  if (std::isnan(change))
    return std::isfinite(now.value) == std::isfinite(before) ? 0
           : std::isfinite(now.value)                        ? -std::numeric_limits<double>::infinity()
                                                             : std::numeric_limits<double>::infinity();
  if (change == 0) return 0;
  return before == 0 ? std::copysign(std::numeric_limits<double>::infinity(), change)
                     : change / std::abs(before);
}

template <class Wanted>
std::vector<Regression> changes(const ValidationReport& report, const Baseline& baseline,
                                const Wanted& matches) {
  std::vector<Regression> out;
  for (const CheckResult& check : report.checks) {
    for (const Metric& now : check.metrics) {
      if (now.wall_clock || now.better == Metric::Better::neither) continue;
      const auto before = std::ranges::find_if(baseline.metrics, [&](const BaselineMetric& old) {
        return old.check == check.id && old.subject == now.subject && old.name == now.name &&
               old.unit == now.unit;
      });
      if (before != baseline.metrics.end() && matches(worsening(now, before->value)))
        out.push_back({check.id, now, before->value});
    }
  }
  return out;
}

}  // namespace

std::string verdict_key(Verdict verdict) {
  std::string out(to_string(verdict));
  std::ranges::replace(out, ' ', '_');
  return out;
}

std::string to_json(const ValidationReport& report, const ResultsOptions& options) {
  Json checks = Json::array();
  for (const CheckResult& check : report.checks) checks.push_back(check_json(check, options));
  Json out{{"schema_version", kResultsVersion},
           {"doppel", report.version},
           {"robot", report.robot},
           {"target", report.target},
           {"engine", report.engine},
           {"seed", report.seed},
           {"effort", effort_text(report.effort)},
           {"strict", report.strict},
           {"suite", report.suite.empty() ? Json(nullptr) : Json(report.suite)},
           {"complete", report.complete},
           {"passed", report.passed()},
           {"headline", headline(report)},
           {"counts", counts_json(report)},
           {"checks", checks},
           {"regressions", regressions_json(report)},
           {"notes", report.notes},
           {"inputs", inputs_json(report)}};
  if (options.wall_clock) out["timing"] = timing_json(report);
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Baseline read_results(const std::filesystem::path& file) {
  const Json json = parsed(file);
  require_version(json, file);
  Baseline out;
  out.file = file;
  try {
    out.robot = json.at("robot").get<std::string>();
    out.seed = json.at("seed").get<std::uint64_t>();
    out.effort = json.at("effort").get<std::string>();
    for (const Json& check : json.at("checks")) add_metrics(check, out);
  } catch (const Json::exception& error) {
    throw InputError("baseline.not_results", make_location(file.string()),
                     fmt::format("the file is not a result of doppel validate: {}", error.what()),
                     "name the results.json of an earlier doppel validate --report");
  }
  return out;
}

std::vector<Regression> regressions(const ValidationReport& report, const Baseline& baseline,
                                    double tolerance) {
  return changes(report, baseline, [tolerance](double worse) { return worse > tolerance; });
}

std::vector<Regression> improvements(const ValidationReport& report, const Baseline& baseline,
                                     double tolerance) {
  return changes(report, baseline, [tolerance](double worse) { return worse < -tolerance; });
}

void shorten_places(ValidationReport& report, const std::filesystem::path& folder) {
  const PathShortener shortener(folder);
  for (CheckResult& check : report.checks) {
    check.summary = shortener.text(std::move(check.summary));
    for (CheckItem& item : check.items) shortener.shorten(item);
  }
  for (ReadFile& file : report.files) file.file = shortener.path(file.file.string());
  if (!report.suite.empty()) report.suite = shortener.path(report.suite);
}

}  // namespace doppel
