#include "doppel/validation/reports/html_report.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "doppel/lab/curve_plot/curve_plot.h"
#include "doppel/validation/reports/detail/arm_scene.h"
#include "doppel/validation/reports/detail/html_pieces.h"
#include "doppel/validation/reports/detail/report_parts.h"
#include "doppel/validation/reports/report_formats.h"
#include "doppel/validation/reports/results.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxDrawnPoses = 60;
constexpr std::size_t kMaxItems = 200;            // of one check
constexpr std::size_t kPlotBytes = 1'000'000;     // of all curves
constexpr std::size_t kDrawingBytes = 1'100'000;  // of all drawings of arms

std::string_view sign_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::passed:
      return "\u2713";
    case Verdict::failed:
      return "\u2717";
    case Verdict::not_run:
      return "\u2298";
    case Verdict::warned:
      return "!";
    case Verdict::not_judged:
      return "?";
    case Verdict::waived:
      return "~";
    case Verdict::not_applicable:
      break;
  }
  return "\u2013";
}

std::string badge(Verdict verdict) {
  return fmt::format("<span class=\"badge {}\">{} {}</span>", verdict_key(verdict), sign_of(verdict),
                     to_string(verdict));
}

// "elbow=0.5"; what is only rounding is zero.
std::string place_text(const std::string& joint, double position) {
  constexpr double kMinPosition = 1e-9;
  return fmt::format("{}={:.6g}", joint, std::abs(position) < kMinPosition ? 0 : position);
}

std::string percent_encoded(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_plain =
        byte < 128 && (std::isalnum(byte) != 0 || c == '-' || c == '.' || c == '_' || c == '~');
    out += is_plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return out;
}

// The address of a configuration in the page, as the value of an attribute.
std::string page_address(const std::string& page, const PosedEvidence& pose) {
  std::string out = markup(page);
  for (std::size_t i = 0; i < pose.joints.size(); ++i)
    out += fmt::format("{}q={}", i == 0 ? "?" : "&amp;",
                       percent_encoded(place_text(pose.joints[i].first, pose.joints[i].second)));
  return out;
}

class HtmlPage {
 public:
  HtmlPage(const ValidationReport& report, const Subject* subject, std::string page)
      : report_(report), page_(std::move(page)) {
    if (subject == nullptr || subject->model == nullptr || subject->compiled == nullptr) return;
    const std::size_t poses = std::min(pose_count(), kMaxDrawnPoses);
    if (poses > 0) scene_.emplace(*subject, poses);
    if (scene_ && scene_->is_empty()) scene_.reset();
  }

  std::string text() {
    std::string body = verdict() + failures() + attention();
    for (const CheckKind kind : {CheckKind::gate, CheckKind::test, CheckKind::extra}) body += checks(kind);
    body += environment();
    std::string out = head() + "<main>\n" + body + "</main>\n";
    if (scene_ && !poses_.empty())
      out += "<script type=\"application/json\" id=\"arm\">" + arm_data() + "</script>\n";
    out += fmt::format("<script>{}</script>\n</body>\n</html>\n", report_script());
    return out;
  }

 private:
  [[nodiscard]] bool is_failing(const CheckResult& check) const {
    return is_failure(check.verdict, report_.strict);
  }

  [[nodiscard]] std::size_t pose_count() const {
    std::size_t out = 0;
    for (const CheckResult& check : report_.checks) {
      for (const CheckItem& item : check.items) out += item.poses.size();
    }
    return out;
  }

  [[nodiscard]] std::string head() const {
    return fmt::format(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<meta name=\"color-scheme\" content=\"light dark\">\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
        "'unsafe-inline'; "
        "script-src 'unsafe-inline'; img-src data:\">\n"
        "<title>{}: {} - doppel validate</title>\n<style>{}</style>\n</head>\n<body>\n",
        markup(report_.robot), report_.passed() ? "passed" : "failed", report_style());
  }

  // -- sections

  [[nodiscard]] std::string verdict() const {
    std::string counts;
    for (int i = static_cast<int>(Verdict::failed); i >= 0; --i) {
      const auto one = static_cast<Verdict>(i);
      if (report_.count(one) > 0) counts += fmt::format("<li>{} {}</li>", badge(one), report_.count(one));
    }
    return fmt::format(
        "<section class=\"card verdict{}\" id=\"verdict\">\n<p class=\"quiet\">doppel validate {}</p>\n"
        "<h1>{} {}: {}</h1>\n<p class=\"headline\">{}</p>\n<ul class=\"counts\">{}</ul>\n</section>\n",
        report_.passed() ? "" : " bad", markup(report_.target), report_.passed() ? "\u2713" : "\u2717",
        markup(report_.robot), report_.passed() ? "passed" : "failed", markup(headline(report_)), counts);
  }

  [[nodiscard]] std::string improvements() const {
    std::string out;
    for (const Regression& improvement : report_.improvements)
      out += fmt::format("<li>{}</li>\n", markup(improvement_text(improvement)));
    return out.empty() ? ""
                       : "<h2 id=\"better\">Better than before</h2>\n<ul class=\"card\">\n" + out + "</ul>\n";
  }

  std::string failures() {
    std::string out;
    for (const Regression& regression : report_.regressions)
      out += fmt::format(
          "<article class=\"card failure\"><header><span class=\"badge failed\">\u2717 worse than "
          "before</span> "
          "<h3>{}</h3></header></article>\n",
          markup(regression_text(regression)));
    for (const CheckResult& check : report_.checks) {
      if (is_failing(check)) out += article(check, "failure");
    }
    if (!out.empty()) out = "<h2 id=\"failures\">What failed</h2>\n" + pose_help() + out;
    return out + improvements();
  }

  std::string attention() {
    std::string out;
    for (const CheckResult& check : report_.checks) {
      const bool is_careful = check.verdict == Verdict::warned || check.verdict == Verdict::not_judged ||
                              check.verdict == Verdict::waived;
      if (is_careful && !is_failing(check)) out += article(check, "failure careful");
    }
    for (const std::string& note : report_.notes) out += "<p class=\"card\">" + markup(note) + "</p>\n";
    return out.empty() ? "" : "<h2 id=\"attention\">What a person should read</h2>\n" + out;
  }

  [[nodiscard]] std::string pose_help() const {
    if (pose_count() == 0) return "";
    return fmt::format(
        "<p class=\"quiet\">A configuration is opened in {}; the line below it moves a running twin "
        "there.</p>\n",
        page_ == kUsualPage
            ? fmt::format("the page of <code>doppel view {}</code>", markup(shell_word(report_.target)))
            : fmt::format("the page at {}", markup(page_)));
  }

  std::string article(const CheckResult& check, const char* kind) {
    std::string out = fmt::format(
        "<article class=\"card {}\" id=\"{}-why\"><header>{} <h3>{} {}</h3></header>\n<p>{}</p>\n", kind,
        markup(check.id), badge(check.verdict), markup(check.id), markup(check.title), markup(check.summary));
    if (const CheckInfo* const info = find_check(check.id))
      out += fmt::format("<p class=\"quiet\">Limit: {}</p>\n", markup(info->limit));
    std::size_t shown = 0, others = 0;
    for (const CheckItem& item : check.items) {
      if (!is_notable(item)) continue;
      if (shown < kMaxItems) {
        out += item_html(check, item);
        ++shown;
      } else {
        ++others;
      }
    }
    if (others > 0) out += fmt::format("<p class=\"quiet\">and {} more, in results.json</p>\n", others);
    return out + "</article>\n";
  }

  std::string checks(CheckKind kind) {
    std::string out;
    for (const CheckResult& check : report_.checks) {
      if (kind_of(check) == kind) out += check_row(check);
    }
    return out.empty()
               ? ""
               : fmt::format("<section>\n<h2>{}</h2>\n<div>\n{}</div>\n</section>\n", heading_of(kind), out);
  }

  std::string check_row(const CheckResult& check) {
    std::string out = fmt::format(
        "<details class=\"check\" id=\"{}\"><summary>{}<span class=\"id\">{}</span><span "
        "class=\"title\">{}</span>"
        "<span class=\"result\">{}</span></summary>\n<div class=\"inside\">\n",
        markup(check.id), badge(check.verdict), markup(check.id), markup(check.title), markup(check.summary));
    const CheckInfo* const info = find_check(check.id);
    if (info != nullptr)
      out += fmt::format("<p class=\"quiet\">Decided by: {}. Limit: {}.</p>\n", markup(info->decided_by),
                         markup(info->limit));
    const bool is_above = std::ranges::any_of(check.items, is_notable);
    if (is_above)
      out += fmt::format("<p><a href=\"#{}-why\">Causes, fixes and evidence</a></p>\n", markup(check.id));
    std::size_t shown = 0;
    for (const CheckItem& item : check.items) {
      if (is_notable(item) && is_listed_above(check)) continue;
      if (shown++ < kMaxItems) out += item_html(check, item);
    }
    for (const std::string& note : check.notes) out += "<p>" + markup(note) + "</p>\n";
    return out + metrics(check) + "</div></details>\n";
  }

  [[nodiscard]] bool is_listed_above(const CheckResult& check) const {
    return is_failing(check) ||
           (check.verdict != Verdict::passed && check.verdict != Verdict::not_applicable);
  }

  [[nodiscard]] static std::string metrics(const CheckResult& check) {
    if (check.metrics.empty()) return "";
    std::string rows;
    for (const Metric& metric : check.metrics) {
      const bool is_over =
          metric.limit && ((metric.better == Metric::Better::lower && metric.value > *metric.limit) ||
                           (metric.better == Metric::Better::higher && metric.value < *metric.limit));
      rows += fmt::format(
          "<tr><td>{}</td><td>{}</td><td class=\"number{}\">{}</td><td "
          "class=\"number\">{}</td><td>{}</td></tr>\n",
          markup(metric.subject), markup(metric.name), is_over ? " over" : "", number_text(metric.value),
          metric.limit ? number_text(*metric.limit) : "", markup(metric.unit));
    }
    return "<div class=\"table\"><table><thead><tr><th>of</th><th>number</th><th "
           "class=\"number\">value</th><th "
           "class=\"number\">limit</th><th>unit</th></tr></thead><tbody>\n" +
           rows + "</tbody></table></div>\n";
  }

  [[nodiscard]] std::string environment() const {
    std::string rows, files;
    const auto row = [&rows](const char* name, const std::string& value) {
      if (!value.empty()) rows += fmt::format("<dt>{}</dt><dd>{}</dd>\n", name, markup(value));
    };
    row("Robot", report_.robot);
    row("Target", report_.target);
    row("doppel", report_.version);
    row("Engine", report_.engine);
    row("Seed", std::to_string(report_.seed));
    row("Effort", std::string(effort_text(report_.effort)));
    row("Suite", report_.suite.empty() ? "none: the defaults" : report_.suite);
    row("Time", fmt::format("{:.3g} s", report_.seconds));
    for (const ReadFile& file : report_.files)
      files += fmt::format("<tr><td>{}</td><td class=\"hash\">{}</td></tr>\n", markup(file.file.string()),
                           file.sha256 == kNoFile ? "no such file" : markup(file.sha256));
    if (!files.empty())
      files = fmt::format(
          "<details><summary>{} files with their SHA-256</summary><div class=\"table\"><table><tbody>\n{}"
          "</tbody></table></div></details>\n",
          report_.files.size(), files);
    std::string notes;
    if (left_out_ > 0)
      notes = fmt::format(
          "<p class=\"quiet\">{} curves or drawings are left out, because the file has a limit of {} "
          "MB.</p>\n",
          left_out_, kMaxReportBytes / 1'000'000);
    return fmt::format(
        "<section>\n<h2>Environment</h2>\n<div class=\"card\"><dl>\n{}</dl>\n{}{}</div>\n</section>\n", rows,
        files, notes);
  }

  // -- items

  std::string item_html(const CheckResult& check, const CheckItem& item) {
    std::string out = "<div class=\"item\">\n<p>";
    if (item.verdict != check.verdict) out += badge(item.verdict) + " ";
    if (!item.subject.empty()) out += "<b>" + markup(item.subject) + "</b>: ";
    out += markup(item.message) + "</p>\n";
    if (!item.fix.empty()) out += "<p class=\"fix\">" + markup(item.fix) + "</p>\n";
    if (item.where.known()) out += "<p class=\"place\"><code>" + markup(item.where.str()) + "</code></p>\n";
    out += recording_html(item);
    for (const PosedEvidence& pose : item.poses) out += pose_html(pose);
    if (!item.curves.empty()) out += plot_html(check, item);
    return out + "</div>\n";
  }

  [[nodiscard]] static std::string recording_html(const CheckItem& item) {
    if (item.recording.empty()) return "";
    return fmt::format(
        "<p class=\"recording\">Recording of the motion: <a href=\"{0}\" download>{0}</a>; in the folder of "
        "this report: <code>doppel view {0}</code></p>\n",
        markup(item.recording));
  }

  std::string plot_html(const CheckResult& check, const CheckItem& item) {
    std::string svg = curve_plot(check.id + " " + check.title, item.subject, item.curves);
    if (plot_bytes_ + svg.size() > kPlotBytes) {
      ++left_out_;
      return "";
    }
    plot_bytes_ += svg.size();
    return "<figure class=\"plot\">" + svg + "</figure>\n";
  }

  std::string pose_html(const PosedEvidence& evidence) {
    std::string out = "<figure>\n" + arm_html(evidence);
    std::string links;
    for (const std::string& link : evidence.links) links += (links.empty() ? "" : ", ") + link;
    out += fmt::format("<figcaption>{}{}. <a href=\"{}\">Open in the page</a></figcaption>\n",
                       markup(evidence.caption), links.empty() ? "" : ": " + markup(links),
                       page_address(page_, evidence));
    out += fmt::format(
        "<div class=\"command\"><code>{}</code><button type=\"button\" class=\"copy\" "
        "hidden>Copy</button></div>\n",
        markup(move_command(evidence)));
    return out + "</figure>\n";
  }

  // Equal configurations have one entry in the script's data.
  std::string arm_html(const PosedEvidence& evidence) {
    if (!scene_) return "";
    if (poses_.size() >= kMaxDrawnPoses) {
      ++left_out_;
      return "";
    }
    ArmPose pose = scene_->pose(evidence);
    const std::string svg = scene_->drawing(pose, evidence.caption);
    if (drawing_bytes_ + svg.size() > kDrawingBytes) {
      ++left_out_;
      return "";
    }
    drawing_bytes_ += svg.size();
    poses_.push_back(std::move(pose));
    return fmt::format(
        "<div class=\"arm\" data-pose=\"{}\" data-caption=\"{}\">{}<span class=\"hint\">drag to "
        "turn</span></div>\n",
        poses_.size() - 1, markup(evidence.caption), svg);
  }

  // Without an end tag of the script in a name.
  [[nodiscard]] std::string arm_data() const {
    std::string out;
    for (const char c : scene_->data(poses_)) {
      if (c == '<')
        out += "\\u003c";
      else
        out += c;
    }
    return out;
  }

  const ValidationReport& report_;
  std::string page_;
  std::optional<ArmScene> scene_;
  std::vector<ArmPose> poses_;
  std::size_t plot_bytes_ = 0, drawing_bytes_ = 0, left_out_ = 0;
};

}  // namespace

std::string move_command(const PosedEvidence& evidence) {
  std::string out = "doppel move";
  for (const auto& [name, position] : evidence.joints) out += " " + shell_word(place_text(name, position));
  return out;
}

std::string html_report(const ValidationReport& report, const Subject* subject, const std::string& page) {
  return HtmlPage(report, subject, page).text();
}

}  // namespace doppel
