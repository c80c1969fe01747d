#pragma once
// The terminal's log: lines go to stderr at once, or, while a live table is up, to the table.

#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <vector>

#include "doppel/base/core/log.h"

namespace doppel::app {

// Any thread.
class TerminalLog {
 public:
  // Warnings and errors of a table: a twin may run for days, and a client can cause one with each request.
  static constexpr std::size_t kMaxKept = 500;

  void add(const LogLine& said);
  // For Log::add_sink(): adds lines of severity `least` or worse. This has to outlive the log's use.
  [[nodiscard]] Log::Sink sink(std::optional<Severity> least = std::nullopt) {
    return [this, least](const LogLine& line) {
      if (!least || line.severity >= *least) add(line);
    };
  }
  void table_begins();
  // Warnings and errors that are no longer visible in the table are printed again: the newest kMaxKept, after
  // the number of those before them.
  void table_ends();
  [[nodiscard]] std::vector<LogLine> recent();

 private:
  static void print(const LogLine& line);

  std::mutex mutex_;
  bool table_ = false;
  std::deque<LogLine> recent_;
  std::deque<LogLine> kept_;
  std::size_t left_out_ = 0;  // older than those
};

}  // namespace doppel::app
