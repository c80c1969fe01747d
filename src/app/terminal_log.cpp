#include "app/terminal_log.h"

#include "app/print_stderr.h"
#include "doppel/ros/messages/printable.h"

namespace doppel::app {

void TerminalLog::add(const LogLine& said) {
  // These lines contain names from clients, which may have control characters.
  const LogLine line{said.severity, said.origin, printable(said.text)};
  const std::lock_guard lock(mutex_);
  if (!table_) return print(line);
  recent_.push_back(line);
  if (recent_.size() > 4) recent_.pop_front();
  if (line.severity == Severity::note) return;
  kept_.push_back(line);
  if (kept_.size() <= kMaxKept) return;
  kept_.pop_front();
  ++left_out_;
}

void TerminalLog::table_begins() {
  const std::lock_guard lock(mutex_);
  table_ = true;
}

void TerminalLog::table_ends() {
  const std::lock_guard lock(mutex_);
  table_ = false;
  if (left_out_ > 0) print_stderr("  {} earlier warnings and errors are left out\n", left_out_);
  left_out_ = 0;
  for (const LogLine& line : kept_) print(line);
  kept_.clear();
}

std::vector<LogLine> TerminalLog::recent() {
  const std::lock_guard lock(mutex_);
  return {recent_.begin(), recent_.end()};
}

void TerminalLog::print(const LogLine& line) {
  if (line.severity == Severity::note) {
    print_stderr("  {}: {}\n", line.origin, line.text);
  } else {
    print_stderr("  {}: {}: {}\n", to_string(line.severity), line.origin, line.text);
  }
}

}  // namespace doppel::app
