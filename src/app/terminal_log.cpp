#include "app/terminal_log.h"

#include "app/tell.h"
#include "doppel/messages/utf8.h"

namespace doppel::app {
namespace {

// Names that clients send stand in these lines, and must not steer the terminal.
std::string without_controls(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const Utf8Char c = next_utf8(text, at);
    const bool control = (c.code < 0x20 && c.code != '\n') || (c.code >= 0x7F && c.code < 0xA0);
    out += c.valid && !control ? text.substr(at, c.size) : "?";
    at += c.size;
  }
  return out;
}

}  // namespace

void TerminalLog::add(const LogLine& said) {
  const LogLine line{said.severity, said.origin, without_controls(said.text)};
  const std::lock_guard lock(mutex_);
  if (!table_) return print(line);
  recent_.push_back(line);
  if (recent_.size() > 4) recent_.pop_front();
  if (line.severity != Severity::note) kept_.push_back(line);
}

void TerminalLog::table_begins() {
  const std::lock_guard lock(mutex_);
  table_ = true;
}

void TerminalLog::table_ends() {
  const std::lock_guard lock(mutex_);
  table_ = false;
  for (const LogLine& line : kept_) print(line);
  kept_.clear();
}

std::vector<LogLine> TerminalLog::recent() {
  const std::lock_guard lock(mutex_);
  return {recent_.begin(), recent_.end()};
}

void TerminalLog::print(const LogLine& line) {
  if (line.severity == Severity::note) {
    tell("  {}: {}\n", line.origin, line.text);
  } else {
    tell("  {}: {}: {}\n", to_string(line.severity), line.origin, line.text);
  }
}

}  // namespace doppel::app
