#pragma once
// The verbs of `doppel identify`, one file each.

namespace CLI {
class App;
}

namespace doppel::app {

void add_identify_plan(CLI::App& group, int& exit_code);
void add_identify_record(CLI::App& group, int& exit_code);
void add_identify_fit(CLI::App& group, int& exit_code);
void add_identify_report(CLI::App& group, int& exit_code);

}  // namespace doppel::app
