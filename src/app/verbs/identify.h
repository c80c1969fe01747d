#pragma once
// The verbs of `doppel identify`, one file each.

#include <optional>
#include <string>

#include "doppel/review/identification/payload.h"

namespace CLI {
class App;
}

namespace doppel::app {

// --payload and --payload-link.
struct PayloadWords {
  std::string payload, link;
};
void add_payload_options(CLI::App& verb, PayloadWords& words, const std::string& about);
// nullopt: no --payload. Throws InputError.
std::optional<Payload> payload_of(const PayloadWords& words);

void add_identify_plan(CLI::App& group, int& exit_code);
void add_identify_record(CLI::App& group, int& exit_code);
void add_identify_fit(CLI::App& group, int& exit_code);
void add_identify_dynamics(CLI::App& group, int& exit_code);
void add_identify_report(CLI::App& group, int& exit_code);

}  // namespace doppel::app
