#pragma once
// The log of the running program: lines with level and origin, to sinks (terminal, /rosout, a test). Not for
// use within a step, where lines are recorded and logged between steps. Sinks are added before threads log;
// they are called on the logging thread.

#include <functional>
#include <source_location>
#include <string>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/export.h"

namespace doppel {

struct LogLine {
  Severity severity = Severity::note;
  std::string origin;  // node or module: "omarm_arm_controller"
  std::string text;
  std::source_location where = std::source_location::current();  // in the sources
};

class DOPPEL_API Log {
 public:
  using Sink = std::function<void(const LogLine&)>;

  void add_sink(Sink sink) { sinks_.push_back(std::move(sink)); }
  using Where = std::source_location;
  void line(Severity severity, std::string origin, std::string text, Where where = Where::current()) const {
    const LogLine l{severity, std::move(origin), std::move(text), where};
    for (const Sink& sink : sinks_) sink(l);
  }
  void note(std::string origin, std::string text, Where where = Where::current()) const {
    line(Severity::note, std::move(origin), std::move(text), where);
  }
  void warning(std::string origin, std::string text, Where where = Where::current()) const {
    line(Severity::warning, std::move(origin), std::move(text), where);
  }
  void error(std::string origin, std::string text, Where where = Where::current()) const {
    line(Severity::error, std::move(origin), std::move(text), where);
  }

 private:
  std::vector<Sink> sinks_;
};

}  // namespace doppel
