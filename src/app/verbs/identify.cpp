// doppel identify: the servos of a real or simulated arm, from recordings of its motions.
#include "app/verbs/identify.h"

#include <CLI/CLI.hpp>

#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"

namespace doppel::app {

void add_payload_options(CLI::App& verb, PayloadWords& words, const std::string& about) {
  CLI::Option* const payload =
      verb.add_option("--payload", words.payload,
                      about + ": kg or 200g, with its centre of mass in the link's frame as 200g@0,0,0.06")
          ->type_name("MASS[@X,Y,Z]");
  verb.add_option("--payload-link", words.link, "The link that carries it (default: the arm's tip)")
      ->type_name("LINK")
      ->needs(payload);
}

std::optional<Payload> payload_of(const PayloadWords& words) {
  if (words.payload.empty()) return {};
  return read_payload(words.payload, words.link);
}

void add_identify(CLI::App& app, int& exit_code) {
  CLI::App& group =
      add_group(app, "identify", "Parameters of an arm's servos, from recordings of its motions",
                "doppel identify plan omarm_one\n  doppel identify record --plan plan.yaml -o motions\n"
                "  doppel identify fit omarm_one --recording motions --write\n"
                "  doppel identify dynamics kate --recording motions\n"
                "  doppel identify report omarm_one --recording motions -o servos.html");
  add_identify_plan(group, exit_code);
  add_identify_record(group, exit_code);
  add_identify_fit(group, exit_code);
  add_identify_dynamics(group, exit_code);
  add_identify_report(group, exit_code);
}

}  // namespace doppel::app
