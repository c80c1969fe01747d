// doppel identify: the servos of a real or simulated arm, from recordings of its motions.
#include "app/verbs/identify.h"

#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"

namespace doppel::app {

void add_identify(CLI::App& app, int& exit_code) {
  CLI::App& group =
      add_group(app, "identify", "Parameters of an arm's servos, from recordings of its motions",
                "doppel identify plan omarm_one\n  doppel identify record --plan plan.yaml -o motions\n"
                "  doppel identify fit omarm_one --recording motions --write\n"
                "  doppel identify report omarm_one --recording motions -o servos.html");
  add_identify_plan(group, exit_code);
  add_identify_record(group, exit_code);
  add_identify_fit(group, exit_code);
  add_identify_report(group, exit_code);
}

}  // namespace doppel::app
