#pragma once
// What the facts mean for a twin. Judging reads nothing but its argument.

#include <string>
#include <vector>

#include "doppel/doctor/machine.h"

namespace doppel::doctor {

enum class Level { ok, note, problem };  // a problem prevents `up`

std::string_view to_string(Level level);

struct Finding {
  Level level = Level::ok;
  std::string subject;  // "engines", "network"
  std::string name;     // stable, for programs: "engine.mujoco"
  std::string what;     // what is there
  std::string why;      // what it leads to; empty where it is ok
  std::string remedy;   // what to do; empty where it is ok
};

std::vector<Finding> judge(const Machine& machine);

// One per subject, in the order of a report.
std::vector<Finding> judge_program(const ProgramFacts& facts);
std::vector<Finding> judge_processor(const ProcessorFacts& facts);
std::vector<Finding> judge_display(const DisplayFacts& facts);
std::vector<Finding> judge_network(const NetworkFacts& facts);
std::vector<Finding> judge_storage(const StorageFacts& facts);

bool has_problem(const std::vector<Finding>& findings);

// For a person, with ANSI colours if `coloured`; for programs.
std::string report_text(const std::vector<Finding>& findings, bool coloured);
std::string report_json(const Machine& machine, const std::vector<Finding>& findings);

}  // namespace doppel::doctor
