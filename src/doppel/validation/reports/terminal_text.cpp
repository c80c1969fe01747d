// The report for people: a line for each check in aligned columns, below it what fails and warns.
#include <algorithm>
#include <filesystem>

#include "doppel/review/audit/text_layout.h"
#include "doppel/validation/reports/detail/report_parts.h"
#include "doppel/validation/reports/report_formats.h"

namespace doppel {
namespace {

constexpr std::size_t kShownItems = 12;       // of one check; the others are counted
constexpr std::size_t kMinSummaryWidth = 30;  // narrower, the summary has a line of its own
constexpr std::size_t kMaxSubjectColumn = 26;

TextTone tone_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::failed:
    case Verdict::not_run:
      return TextTone::bad;
    case Verdict::warned:
    case Verdict::not_judged:
    case Verdict::waived:
      return TextTone::careful;
    case Verdict::passed:
      return TextTone::calm;
    case Verdict::not_applicable:
      break;
  }
  return TextTone::quiet;
}

std::string padded(std::string text, std::size_t column) {
  const std::size_t width = display_width(text);
  if (width < column) text.append(column - width, ' ');
  return text;
}

class ChecksPage {
 public:
  ChecksPage(const ValidationReport& report, const TerminalStyle& style)
      : report_(report), style_(style), page_(style.colour, style.width) {
    for (const CheckResult& check : report.checks) {
      if (!is_shown(check)) continue;
      word_ = std::max(word_, display_width(to_string(check.verdict)));
      id_ = std::max(id_, display_width(check.id));
      title_ = std::max(title_, display_width(check.title));
    }
  }

  std::string text() {
    const CheckResult* last = nullptr;
    for (const CheckResult& check : report_.checks) {
      if (!is_shown(check)) continue;
      if (last != nullptr && kind_of(*last) != kind_of(check)) page_.blank();
      write(check);
      last = &check;
    }
    if (last != nullptr) page_.blank();
    for (const Regression& regression : report_.regressions)
      page_.row({{TextTone::bad, "worse"}, {TextTone::plain, "  "}}, regression_text(regression));
    if (!style_.failures_only) {
      write_improvements();
      for (const std::string& note : report_.notes) page_.labelled(0, "note", note);
    }
    const bool has_more = !report_.notes.empty() || !report_.improvements.empty();
    if (!report_.regressions.empty() || (!style_.failures_only && has_more)) page_.blank();
    if (!style_.failures_only) page_.quiet(0, run_text());
    page_.paragraph(0, headline(report_), report_.passed() ? TextTone::strong : TextTone::bad);
    return page_.take();
  }

 private:
  void write_improvements() {
    constexpr std::size_t kMaxShown = 10;
    const std::size_t count = std::min(kMaxShown, report_.improvements.size());
    for (std::size_t i = 0; i < count; ++i)
      page_.row({{TextTone::calm, "better"}, {TextTone::plain, " "}},
                improvement_text(report_.improvements[i]));
    if (count < report_.improvements.size())
      page_.quiet(0, fmt::format("and {} more that are better, in the other forms of the report",
                                 report_.improvements.size() - count));
  }

  [[nodiscard]] bool is_shown(const CheckResult& check) const {
    return !style_.failures_only || is_failure(check.verdict, report_.strict);
  }

  [[nodiscard]] std::string run_text() const {
    return fmt::format("{}: {}, seed {}, {}, {:.3g} s", report_.robot, report_.engine, report_.seed,
                       effort_text(report_.effort), report_.seconds);
  }

  void write(const CheckResult& check) {
    const std::size_t summary = word_ + id_ + title_ + 6;
    const bool fits = summary + kMinSummaryWidth <= static_cast<std::size_t>(std::max(style_.width, 0));
    std::vector<std::pair<TextTone, std::string>> parts = {
        {tone_of(check.verdict), std::string(to_string(check.verdict))},
        {TextTone::plain, std::string(word_ - display_width(to_string(check.verdict)) + 2, ' ')},
        {TextTone::quiet, padded(check.id, id_ + 2)},
        {TextTone::strong, check.title}};
    if (fits) {
      parts.emplace_back(TextTone::plain, std::string(title_ - display_width(check.title) + 2, ' '));
      page_.row(parts, check.summary);
    } else {
      page_.line(parts);
      if (!check.summary.empty()) page_.paragraph(indent(), check.summary);
    }
    items(check);
    if (style_.failures_only) return;
    for (const std::string& note : check.notes) page_.labelled(indent(), "note", note);
  }

  // Items begin below the title, on narrow terminals at the left.
  [[nodiscard]] std::size_t indent() const { return style_.width < 80 ? 2 : word_ + id_ + 4; }

  void items(const CheckResult& check) {
    std::vector<const CheckItem*> notable;
    std::size_t column = 0;
    for (const CheckItem& item : check.items) {
      if (!is_notable(item) || (style_.failures_only && !is_failure(item.verdict, report_.strict))) continue;
      notable.push_back(&item);
    }
    const std::size_t shown = notable.size() <= kShownItems + 1 ? notable.size() : kShownItems;
    for (std::size_t i = 0; i < shown; ++i)
      column = std::max(column, std::min(display_width(notable[i]->subject), kMaxSubjectColumn));
    for (std::size_t i = 0; i < shown; ++i) {
      const bool last = i + 1 == shown || notable[i + 1]->fix != notable[i]->fix;
      entry(check, *notable[i], column, last);
    }
    if (shown < notable.size())
      page_.quiet(indent(),
                  fmt::format("and {} more, in the other forms of the report", notable.size() - shown));
  }

  // Neighbours with one fix share its line.
  void entry(const CheckResult& check, const CheckItem& item, std::size_t column, bool with_fix) {
    const std::string word = item.verdict == check.verdict ? "" : std::string(to_string(item.verdict)) + ": ";
    const bool has_column = column > 0;
    if (has_column)
      page_.entry(indent(), item.subject, column, word + item.message);
    else
      page_.paragraph(indent(), word + item.message);
    const std::size_t below = indent() + (has_column ? column + 2 : 2);
    if (item.where.known()) place(below, item.where.str());
    if (!item.recording.empty() && !style_.recordings.empty())
      place(below, "doppel view " + shell_word(recording_path(item)));
    if (with_fix) page_.labelled(below, "fix", item.fix);
  }

  [[nodiscard]] std::string recording_path(const CheckItem& item) const {
    return (std::filesystem::path(style_.recordings) / item.recording).string();
  }

  // Further to the left where it would not fit.
  void place(std::size_t column, const std::string& text) {
    const std::size_t width = static_cast<std::size_t>(std::max(style_.width, 0)),
                      length = display_width(text);
    page_.quiet(length < width ? std::min(column, width - length) : std::min(column, indent()), text);
  }

  const ValidationReport& report_;
  const TerminalStyle& style_;
  TextLayout page_;
  std::size_t word_ = 0, id_ = 0, title_ = 0;  // widths of columns
};

std::string counted_passes(const ValidationReport& report) {
  std::string out;
  const auto kinds = {std::pair{CheckKind::gate, "gate"}, std::pair{CheckKind::test, "test"},
                      std::pair{CheckKind::extra, "extra"}};
  for (const auto& [kind, word] : kinds) {
    const auto count = std::ranges::count_if(report.checks, [kind = kind](const CheckResult& check) {
      return kind_of(check) == kind && (check.verdict == Verdict::passed ||
                                        check.verdict == Verdict::warned || check.verdict == Verdict::waived);
    });
    if (count > 0)
      out += fmt::format("{}{} {}{}", out.empty() ? "" : ", ", count, word, count == 1 ? "" : "s");
  }
  return out;
}

// "T4, G05"
std::string ids_with(const ValidationReport& report, Verdict verdict) {
  std::string out;
  for (const CheckResult& check : report.checks) {
    if (check.verdict == verdict) out += (out.empty() ? "" : ", ") + check.id;
  }
  return out;
}

}  // namespace

std::string headline(const ValidationReport& report) {
  std::string out;
  const auto part = [&out](std::string_view word, const std::string& text) {
    if (!text.empty()) out += fmt::format("{}{}: {}", out.empty() ? "" : "; ", word, text);
  };
  if (report.passed()) {
    part("passed", counted_passes(report));
    if (out.empty() && report.count(Verdict::not_judged) == 0)
      out = report.checks.empty() ? "no check was chosen" : "nothing of the machine could be judged";
  } else {
    part("failed", ids_with(report, Verdict::failed));
    std::string worse;
    for (const Regression& regression : report.regressions) {
      if (worse.find(regression.check) == std::string::npos)
        worse += (worse.empty() ? "" : ", ") + regression.check;
    }
    part("worse than before", worse);
    if (out.empty() && report.strict && report.complete) out = "failed by --strict";
    part("not run", ids_with(report, Verdict::not_run));
    if (!report.complete) out += out.empty() ? "ended before all checks had run" : "; ended early";
  }
  part("warning", ids_with(report, Verdict::warned));
  part("not judged", ids_with(report, Verdict::not_judged));
  part("waived", ids_with(report, Verdict::waived));
  if (report.passed()) part("not applicable", ids_with(report, Verdict::not_applicable));
  return out;
}

std::string to_text(const ValidationReport& report, const TerminalStyle& style) {
  return ChecksPage(report, style).text();
}

}  // namespace doppel
