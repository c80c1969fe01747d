#pragma once
// The log of the running program: lines with level and origin, to sinks (terminal, /rosout, a test). Not for
// use within a step, where lines are recorded and logged between steps. Sinks are added before threads log;
// they are called on the logging thread.

#include <functional>
#include <string>
#include <vector>

#include "doppel/base/core/code_location.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"

namespace doppel {

struct LogLine {
  Severity severity = Severity::note;
  std::string origin;  // node or module: "omarm_arm_controller"
  std::string text;
  CodeLocation where = CodeLocation::current();
};

class DOPPEL_API Log {
 public:
  using Sink = std::function<void(const LogLine&)>;

  void add_sink(Sink sink) { sinks_.push_back(std::move(sink)); }
  void line(Severity severity, std::string origin, std::string text,
            CodeLocation where = CodeLocation::current()) const {
    const LogLine l{severity, std::move(origin), std::move(text), where};
    for (const Sink& sink : sinks_) sink(l);
  }
  void note(std::string origin, std::string text, CodeLocation where = CodeLocation::current()) const {
    line(Severity::note, std::move(origin), std::move(text), where);
  }
  void warning(std::string origin, std::string text, CodeLocation where = CodeLocation::current()) const {
    line(Severity::warning, std::move(origin), std::move(text), where);
  }
  void error(std::string origin, std::string text, CodeLocation where = CodeLocation::current()) const {
    line(Severity::error, std::move(origin), std::move(text), where);
  }

 private:
  std::vector<Sink> sinks_;
};

}  // namespace doppel
