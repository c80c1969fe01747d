#include "doppel/lab/resimulation/detail/own_names.h"

#include <algorithm>

#include "doppel/ros/record/recorder_services.h"
#include "doppel/twin/journal/input_journal.h"
#include "doppel/twin/loop/state_publisher.h"

namespace doppel {
namespace {

constexpr const char* kOwnNode = "/doppel";

}  // namespace

ServicesAround::ServicesAround(NameRules& rules) {
  const std::string node = rules.node(kOwnNode);
  for (const char* const name :
       {"~/snapshot", "/doppel/validate", "/doppel/validate/cancel", "/doppel/validate/checks",
        "/doppel/validate/report", "/doppel/calibrate/measure", "/doppel/calibrate/forget",
        "/doppel/calibrate/write", "/doppel/calibrate/undo", "/rviz/get_resource", kResourceService})
    names_.insert(rules.resolve(NameKind::service, name, node));
  folders_ = {rules.node(kRecorderNode) + "/", "/doppel/validate/", "/doppel/calibrate/"};
}

bool ServicesAround::has(const std::string& service) const {
  return names_.contains(service) || std::ranges::any_of(folders_, [&](const std::string& folder) {
           return service.starts_with(folder);
         });
}

std::vector<std::string> topics_of_wall_clock(NameRules& rules) {
  const std::string node = rules.node(kOwnNode);
  std::vector<std::string> out;
  for (const char* const name :
       {"/rosout", "/diagnostics", "~/status", "~/health", "~/sources", "/doppel/sensors",
        "/doppel/validation", "/doppel/validation/results", kInputsTopic, "/parameter_events"})
    out.push_back(rules.resolve(NameKind::topic, name, node));
  return out;
}

}  // namespace doppel
