#include "app/live_table.h"

#include <fmt/format.h>
#include <langinfo.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <clocale>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace doppel::app {
namespace {

constexpr int kBarWidth = 10;

// The number of columns that a UTF-8 text takes; the table uses no wide or combining characters.
std::size_t columns(std::string_view text) {
  std::size_t count = 0;
  bool escape = false;
  for (const char c : text) {
    if (c == '\x1b') escape = true;
    if (!escape && (static_cast<unsigned char>(c) & 0xC0) != 0x80) ++count;
    if (escape && c == 'm') escape = false;
  }
  return count;
}

// At most `width` columns of `text`; escape sequences are kept and count as zero columns.
std::string shortened(std::string_view text, std::size_t width) {
  if (columns(text) <= width) return std::string(text);
  std::string out;
  std::size_t used = 0;
  bool escape = false;
  for (const char c : text) {
    if (c == '\x1b') escape = true;
    const bool starts = !escape && (static_cast<unsigned char>(c) & 0xC0) != 0x80;
    if (starts && ++used >= width) break;
    out += c;
    if (escape && c == 'm') escape = false;
  }
  return out + ".";
}

std::string padded(std::string_view text, std::size_t width) {
  std::string out = shortened(text, width);
  return out + std::string(width - columns(out), ' ');
}

class Painter {
 public:
  explicit Painter(const TableStyle& style) : style_(style) {}
  [[nodiscard]] std::string paint(std::string_view code, std::string_view text) const {
    return style_.colour ? fmt::format("\x1b[{}m{}\x1b[0m", code, text) : std::string(text);
  }
  [[nodiscard]] std::string dim(std::string_view text) const { return paint("2", text); }
  [[nodiscard]] std::string bold(std::string_view text) const { return paint("1", text); }
  [[nodiscard]] std::string bar(double fraction) const {
    const double load = std::clamp(std::abs(fraction), 0.0, 1.0);
    const int full = static_cast<int>(std::lround(load * kBarWidth));
    std::string filled, empty;
    for (int i = 0; i < kBarWidth; ++i) {
      (i < full ? filled : empty) += i < full ? (style_.unicode ? "█" : "#") : (style_.unicode ? "·" : ".");
    }
    const char* colour = load > 0.95 ? "31" : load > 0.7 ? "33" : "32";
    return paint(colour, filled) + dim(empty);
  }
  [[nodiscard]] const char* dot() const { return style_.unicode ? "·" : "-"; }

 private:
  const TableStyle& style_;
};

std::string angle(double value) {
  return std::isfinite(value) ? fmt::format("{:8.4f}", value) : fmt::format("{:>8}", "-");
}

std::string joint_row(const JointSnapshot& joint, std::size_t name_width, const Painter& paint) {
  const double error = joint.target - joint.q;
  std::string row = fmt::format(
      "  {}  {} {}  {}  {}", padded(joint.name, name_width), paint.bold(angle(joint.q)),
      paint.dim(fmt::format("{:7.1f}", joint.q * 180.0 / std::numbers::pi)), angle(joint.target),
      paint.dim(std::isfinite(error) ? fmt::format("{:8.4f}", error) : fmt::format("{:>8}", "-")));
  if (joint.mimics) return row + paint.dim("  follows");
  if (std::isfinite(joint.effort) && joint.effort > 0) {
    return row +
           fmt::format("  {} {:6.3f} / {:.3g}", paint.bar(joint.tau / joint.effort), joint.tau, joint.effort);
  }
  return row + fmt::format("  {:>{}} {:6.3f}", "", kBarWidth, joint.tau);
}

std::string controllers_line(const Snapshot& snapshot, const Painter& paint) {
  std::string out;
  for (const ControllerView& controller : snapshot.controllers) {
    if (!out.empty()) out += "  ";
    const bool active = controller.state == ControllerState::active;
    out += controller.name + " " + paint.paint(active ? "32" : "33", doppel::to_string(controller.state));
  }
  return out.empty() ? paint.paint("33", "no controllers: the joints are passive") : out;
}

}  // namespace

TableStyle terminal_style(int fd) {
  TableStyle style;
  winsize size{};
  if (ioctl(fd, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) {
    style.width = size.ws_col;
    style.height = size.ws_row;
  }
  const char* term = std::getenv("TERM");
  const char* no_colour = std::getenv("NO_COLOR");
  style.colour =
      (no_colour == nullptr || *no_colour == '\0') && term != nullptr && std::string_view(term) != "dumb";
  const locale_t locale = newlocale(LC_CTYPE_MASK, "", nullptr);
  style.unicode = locale != nullptr && std::string_view(nl_langinfo_l(CODESET, locale)) == "UTF-8";
  if (locale != nullptr) freelocale(locale);
  return style;
}

std::vector<std::string> render(const TableView& view, const TableStyle& style) {
  const Painter paint(style);
  std::vector<std::string> lines;
  const std::string pace =
      view.paused ? paint.paint("33", "paused") : fmt::format("{:.2f} x real time", view.real_time_factor);
  lines.push_back(fmt::format(" {}  {}  {}{}", paint.bold(view.title),
                              fmt::format("t = {:.2f} s", to_seconds(view.snapshot.now)), pace,
                              view.snapshot.stopped ? "  " + paint.paint("31", "STOP") : ""));
  lines.emplace_back();

  std::size_t name_width = 5;
  for (const JointSnapshot& joint : view.snapshot.joints)
    name_width = std::max(name_width, columns(joint.name));
  name_width = std::min<std::size_t>(name_width, 24);
  lines.push_back(paint.dim(fmt::format("  {}  {:>8} {:>7}  {:>8}  {:>8}  {}", padded("joint", name_width),
                                        "rad", "deg", "target", "error", "effort / limit")));
  const auto room = static_cast<std::size_t>(std::max(4, style.height - 10));
  for (std::size_t i = 0; i < view.snapshot.joints.size(); ++i) {
    if (i + 1 == room && view.snapshot.joints.size() > room) {
      lines.push_back(paint.dim(fmt::format("  ... and {} more", view.snapshot.joints.size() - i)));
      break;
    }
    lines.push_back(joint_row(view.snapshot.joints[i], name_width, paint));
  }
  lines.emplace_back();
  lines.push_back("  " + controllers_line(view.snapshot, paint));
  for (const LogLine& line : view.log) {
    const char* colour = line.severity == Severity::error     ? "31"
                         : line.severity == Severity::warning ? "33"
                                                              : "2";
    const std::string first = line.text.substr(0, line.text.find('\n'));
    lines.push_back("  " +
                    paint.paint(colour, shortened(line.origin + ": " + first,
                                                  static_cast<std::size_t>(std::max(20, style.width - 4)))));
  }
  lines.push_back(paint.dim(
      fmt::format("  Ctrl-C quits {} doppel topic echo /joint_states {} doppel move \"JOINT=RAD\" --in 3",
                  paint.dot(), paint.dot())));
  return lines;
}

LiveTable::LiveTable(int fd) : fd_(fd), out_(fd) {}

LiveTable::~LiveTable() {
  if (lines_ > 0) out_.write("\x1b[?25h");  // shows the cursor
}

void LiveTable::draw(const TableView& view) {
  if (!out_.is_idle()) return;
  const TableStyle style = terminal_style(fd_);
  std::string out = lines_ == 0 ? "\x1b[?25l" : fmt::format("\x1b[{}A\r", lines_);
  const auto lines = render(view, style);
  for (const std::string& line : lines) {
    const bool fits = columns(line) < static_cast<std::size_t>(style.width);
    out +=
        (fits ? line : shortened(line, static_cast<std::size_t>(style.width) - 1) + "\x1b[0m") + "\x1b[K\r\n";
  }
  out += "\x1b[J";
  lines_ = lines.size();
  out_.write(out);
}

}  // namespace doppel::app
