#pragma once
// The twin in the terminal: a table that is drawn in place a few times a second, with the latest log
// lines below it.

#include <deque>
#include <mutex>
#include <string>

#include "app/output_writer.h"
#include "app/snapshot.h"
#include "doppel/base/core/log.h"

namespace doppel::app {

struct TableStyle {
  bool colour = true;
  bool unicode = true;
  int width = 100;  // columns of the terminal
  int height = 40;  // its rows
};

// For the terminal on `fd`: size, NO_COLOR, TERM and the locale's character set.
TableStyle terminal_style(int fd);

// The complete picture as text, one line each, never wider than the style allows.
struct TableView {
  std::string title;  // "omarm_one · mujoco 2.2.2"
  Snapshot snapshot;
  double real_time_factor = 0;
  bool paused = false;
  std::vector<LogLine> log;  // newest last
};
std::vector<std::string> render(const TableView& view, const TableStyle& style);

// Draws each picture over the previous one; none while that one is not written. Any thread, one at a time.
class LiveTable {
 public:
  explicit LiveTable(int fd);
  ~LiveTable();  // keeps the last picture, with the cursor below it
  void draw(const TableView& view);

 private:
  int fd_;
  OutputWriter out_;
  std::size_t lines_ = 0;
};

}  // namespace doppel::app
