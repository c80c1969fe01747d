// The audit for people: findings of one rule together, each with its place through macros and includes. Their
// effect and the fix are printed once where they are the same for all.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "doppel/review/audit/audit.h"
#include "doppel/review/audit/detail/finding_text.h"
#include "doppel/review/audit/text_layout.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxSubjectWidth = 26;

TextTone tone_of(Severity severity) {
  return severity == Severity::error     ? TextTone::bad
         : severity == Severity::warning ? TextTone::careful
                                         : TextTone::calm;
}

// Findings of one rule and severity, in the report's order.
struct Group {
  std::vector<const Finding*> findings;
  [[nodiscard]] const Finding& first() const { return *findings.front(); }
  template <class Text>
  [[nodiscard]] bool agree(const Text& text) const {
    return std::all_of(findings.begin(), findings.end(),
                       [&](const Finding* f) { return text(*f) == text(first()); });
  }
};

std::vector<Group> grouped(const std::vector<Finding>& findings) {
  std::vector<Group> out;
  for (const Finding& f : findings) {
    const auto known = std::find_if(out.begin(), out.end(), [&](const Group& g) {
      return g.first().rule == f.rule && g.first().severity == f.severity;
    });
    if (known == out.end())
      out.push_back({{&f}});
    else
      known->findings.push_back(&f);
  }
  return out;
}

// Places relative to the working directory of the shell.
class Places {
 public:
  Places() {
    std::error_code none;
    here_ = std::filesystem::current_path(none).string() + "/";
  }
  [[nodiscard]] std::string operator()(const SourceLocation& where) const {
    std::string text = where.str();
    for (std::size_t at = 0; (at = text.find(here_, at)) != std::string::npos;) text.erase(at, here_.size());
    return text;
  }

 private:
  std::string here_;
};

class Report {
 public:
  Report(const AuditReport& report, const TextStyle& style)
      : report_(report), page_(style.colour, style.width) {}

  std::string text(bool summary_only) {
    if (!summary_only) {
      for (const Group& group : grouped(report_.findings)) write(group);
    }
    summary();
    return page_.take();
  }

 private:
  void write(const Group& group) {
    const Finding& first = group.first();
    const RuleInfo* rule = find_rule(first.rule);
    page_.heading(tone_of(first.severity), to_string(first.severity),
                  rule == nullptr ? first.message : std::string(rule->title), first.rule);
    const bool one_message =
        group.findings.size() > 1 && group.agree([](const Finding& f) { return f.message; });
    const bool one_fix = group.agree(fix_of),
               one_repair = group.agree([](const Finding&f) { return f.repair.empty(); });
    if (one_message) page_.paragraph(2, first.message);
    std::size_t column = 0;
    for (const Finding* f : group.findings) column = std::max(column, display_width(f->subject));
    const bool fixes_apart = !one_fix || !one_repair;
    for (std::size_t i = 0; i < group.findings.size(); ++i) {
      const Finding& f = *group.findings[i];
      entry(f, column, !one_message);
      const Finding* next = i + 1 < group.findings.size() ? group.findings[i + 1] : nullptr;
      // Neighbours with one fix share its line.
      const bool last = next == nullptr || !one_message || fix_of(*next) != fix_of(f) ||
                        next->repair.empty() != f.repair.empty();
      if (fixes_apart && last) page_.labelled(one_message ? 6 : 4, fix_label(f), fix_of(f));
    }
    if (group.agree(consequence_of)) page_.labelled(2, "leads to", consequence_of(first));
    if (!fixes_apart) page_.labelled(2, fix_label(first), fix_of(first));
    page_.blank();
  }

  static std::string fix_label(const Finding& f) { return f.repair.empty() ? "fix" : "fix (--fix)"; }

  void entry(const Finding& f, std::size_t column, bool message) {
    const std::string place = f.where.known() ? places_(f.where) : "";
    if (!message) {
      page_.entry(4, f.subject, column, place, TextTone::quiet);
    } else if (column <= kMaxSubjectWidth) {
      page_.entry(2, f.subject, column, f.message);
      if (!place.empty()) page_.quiet(2 + column + 2, place);
    } else {
      page_.paragraph(2, f.subject, TextTone::strong);
      page_.paragraph(4, f.message);
      if (!place.empty()) page_.quiet(4, place);
    }
  }

  void summary() {
    const auto counted = [&](Severity severity, const char* one) {
      const std::size_t count = report_.count(severity);
      return fmt::format("{} {}{}", count == 0 ? "no" : std::to_string(count), one, count == 1 ? "" : "s");
    };
    const Severity worst = report_.count(Severity::error) > 0     ? Severity::error
                           : report_.count(Severity::warning) > 0 ? Severity::warning
                                                                  : Severity::note;
    const auto fixable = std::count_if(report_.findings.begin(), report_.findings.end(),
                                       [](const Finding& f) { return !f.repair.empty(); });
    std::string rest = fmt::format("  ({}: {} links, {} joints, {:.4g} kg)", report_.robot, report_.links,
                                   report_.joints, report_.mass);
    if (fixable > 0) rest = fmt::format("; --fix repairs {}{}", fixable, rest);
    page_.line({{tone_of(worst),
                 fmt::format("{}, {}, {}", counted(Severity::error, "error"),
                             counted(Severity::warning, "warning"), counted(Severity::note, "note"))},
                {TextTone::plain, rest}});
  }

  const AuditReport& report_;
  TextLayout page_;
  Places places_;
};

std::string profiles_of(const RuleInfo& rule) {
  if (rule.profiles == kAllProfiles) return "all";
  std::string out;
  for (const auto& [profile, name] :
       {std::pair{Profile::gazebo, "gazebo"}, std::pair{Profile::moveit, "moveit"},
        std::pair{Profile::mujoco, "mujoco"}, std::pair{Profile::ros2_control, "ros2_control"}}) {
    if ((rule.profiles & static_cast<unsigned>(profile)) != 0)
      out += fmt::format("{}{}", out.empty() ? "" : ", ", name);
  }
  return out;
}

std::string_view family_of(std::string_view id) {
  return id.substr(0, id.find('.'));
}

std::string cell(std::string_view text) {
  std::string out;
  for (const char c : text) out += c == '|' ? "\\|" : c == '<' ? "&lt;" : std::string(1, c);
  return out;
}

}  // namespace

std::string to_text(const AuditReport& report, const TextStyle& style) {
  return Report(report, style).text(style.summary_only);
}

std::string rules_text(const TextStyle& style) {
  TextLayout page(style.colour, style.width);
  for (const RuleInfo& rule : rule_table()) {
    page.heading(tone_of(rule.severity), to_string(rule.severity), std::string(rule.title),
                 std::string(rule.id));
    page.labelled(2, "prevents", std::string(rule.failure));
    page.labelled(2, "fix", std::string(rule.fix));
    if (rule.profiles != kAllProfiles) page.labelled(2, "concerns", profiles_of(rule));
    page.blank();
  }
  page.line({{TextTone::plain, fmt::format("{} rules", rule_table().size())}});
  return page.take();
}

std::string rules_markdown() {
  std::string out =
      "# The rules of `doppel check`\n\n"
      "Generated by `doppel check --list-rules --markdown`; a test keeps it up to date. An *error* keeps "
      "the\n"
      "robot from loading, or makes a simulation, a planner or a controller wrong; a *warning* is likely to\n"
      "cause unexpected behaviour; a *note* is information. A finding may have a lower grade than its rule\n"
      "where it is harmless or uncertain. `--fix` writes only what follows from the description itself.\n"
      "*Concerns*: the profiles of `--profile` that contain the rule.\n";
  std::string_view family;
  for (const RuleInfo& rule : rule_table()) {
    if (family_of(rule.id) != family) {
      family = family_of(rule.id);
      out += fmt::format(
          "\n## {}\n\n| rule | grade | what is wrong | failure it prevents | fix | concerns "
          "|\n|---|---|---|---|---|---|\n",
          family);
    }
    out += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", rule.id, to_string(rule.severity),
                       cell(rule.title), cell(rule.failure), cell(rule.fix), profiles_of(rule));
  }
  return out;
}

}  // namespace doppel
