#pragma once
// The terminal's log: lines go to stderr at once, or, while a live table is up, to the table.

#include <deque>
#include <mutex>
#include <optional>
#include <vector>

#include "doppel/base/core/log.h"

namespace doppel::app {

// Any thread.
class TerminalLog {
 public:
  void add(const LogLine& said);
  // For Log::add_sink(): adds lines of severity `least` or worse. This has to outlive the log's use.
  [[nodiscard]] Log::Sink sink(std::optional<Severity> least = std::nullopt) {
    return [this, least](const LogLine& line) {
      if (!least || line.severity >= *least) add(line);
    };
  }
  void table_begins();
  // Warnings and errors that are no longer visible in the table are printed again.
  void table_ends();
  [[nodiscard]] std::vector<LogLine> recent();

 private:
  static void print(const LogLine& line);

  std::mutex mutex_;
  bool table_ = false;
  std::deque<LogLine> recent_;
  std::vector<LogLine> kept_;
};

}  // namespace doppel::app
