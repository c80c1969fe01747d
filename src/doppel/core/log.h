#pragma once
// What the running program tells: one stream of lines with level and origin, to sinks (terminal, /rosout, a
// test). Not for the step itself: whoever has something to say there notes it and says it between steps.

#include <functional>
#include <string>
#include <vector>

#include "doppel/core/diagnostic.h"

namespace doppel {

struct LogLine {
  Severity severity = Severity::note;
  std::string origin;  // node or room: "omarm_arm_controller"
  std::string text;
};

class Log {
 public:
  using Sink = std::function<void(const LogLine&)>;

  void add_sink(Sink sink) { sinks_.push_back(std::move(sink)); }
  void line(Severity severity, std::string origin, std::string text) const {
    const LogLine l{severity, std::move(origin), std::move(text)};
    for (const Sink& sink : sinks_) sink(l);
  }
  void note(std::string origin, std::string text) const {
    line(Severity::note, std::move(origin), std::move(text));
  }
  void warning(std::string origin, std::string text) const {
    line(Severity::warning, std::move(origin), std::move(text));
  }
  void error(std::string origin, std::string text) const {
    line(Severity::error, std::move(origin), std::move(text));
  }

 private:
  std::vector<Sink> sinks_;
};

}  // namespace doppel
