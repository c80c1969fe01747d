#pragma once
// Runs the gates and tests of a machine.

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/validation/checks/subject.h"
#include "doppel/validation/checks/suite.h"
#include "doppel/validation/checks/validation_report.h"

namespace doppel {

struct ValidationOptions {
  Effort effort = Effort::standard;
  std::uint64_t seed = 1;
  std::size_t jobs = 1;           // threads
  std::vector<std::string> only;  // ids; empty: all
  std::string joint;              // the only one that is judged; empty: all
  std::string today;              // "2026-11-28", for waivers
  bool strict = false, write_answers = true;
  bool record = false;     // motions that fail are recorded (CheckResult::recordings)
  double max_seconds = 0;  // of wall-clock time, after which no check is begun; 0: no limit
  // Called with the completed fraction and the check that runs, from one thread at a time; false: the
  // validation ends. May be empty.
  std::function<bool(double done, const std::string& id)> progress = {};
  // Called with each result, its waivers applied, when it is there; from one thread at a time. May be empty.
  std::function<void(const CheckResult&)> on_result = {};
};

// Checks that do not depend on each other run side by side; each result is the same for any number of jobs.
// Version and target of the report are the caller's to fill in.
DOPPEL_API ValidationReport validate(const Subject& subject, const Suite& suite,
                                     const ValidationOptions& options);

// The ids of words on a command line: "T4", "g13", "gates", "tests". Throws InputError: there is no such
// check, with the nearest one.
DOPPEL_API std::vector<std::string> check_ids(const std::vector<std::string>& words);

}  // namespace doppel
