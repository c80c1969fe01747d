#pragma once
// The meaning of the facts for a twin. Judging reads nothing but its argument.

#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/review/doctor/machine.h"

namespace doppel::doctor {

enum class Level { ok, note, problem };  // a problem prevents `up`

DOPPEL_API std::string_view to_string(Level level);

struct Finding {
  Level level = Level::ok;
  std::string subject;  // "engines", "network"
  std::string name;     // stable, for programs: "engine.mujoco"
  std::string what;     // what is there
  std::string why;      // what it leads to; empty where it is ok
  std::string remedy;   // what to do; empty where it is ok
};

DOPPEL_API std::vector<Finding> judge(const Machine& machine);

// One per subject, in the order of a report.
DOPPEL_API std::vector<Finding> judge_program(const ProgramFacts& facts);
DOPPEL_API std::vector<Finding> judge_processor(const ProcessorFacts& facts);
DOPPEL_API std::vector<Finding> judge_display(const DisplayFacts& facts);
DOPPEL_API std::vector<Finding> judge_network(const NetworkFacts& facts);
DOPPEL_API std::vector<Finding> judge_storage(const StorageFacts& facts);
DOPPEL_API std::vector<Finding> judge_serial(const SerialFacts& facts);

DOPPEL_API bool has_problem(const std::vector<Finding>& findings);

// For a person, with ANSI colours if `coloured`; for programs.
DOPPEL_API std::string report_text(const std::vector<Finding>& findings, bool coloured);
DOPPEL_API std::string report_json(const Machine& machine, const std::vector<Finding>& findings);

}  // namespace doppel::doctor
