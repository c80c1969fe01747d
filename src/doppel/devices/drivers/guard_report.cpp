#include "doppel/devices/drivers/guard_report.h"

#include <fmt/format.h>

#include <array>

namespace doppel {
namespace {

struct GuardText {
  GuardEvent event;
  const char* text;
};
constexpr std::array<GuardText, 6> kGuardTexts{
    {{kClampedStep, "is commanded faster than its speed limit; its goal moves at 1.2 of it at most"},
     {kClampedLimit, "is commanded beyond its limits; it stops there"},
     {kStalled, "is blocked; its goal yields until it is free"},
     {kReleased, "is free again"},
     {kHalvedSpeed, "is at 60 degrees Celsius or more; its speed is halved"},
     {kDroppedSample, "has reported a position that it cannot have reached; the sample was dropped"}}};

}  // namespace

void log_guard_events(unsigned events, const std::string& component, const std::string& joint,
                      const Log& log) {
  for (const GuardText& one : kGuardTexts) {
    if ((events & one.event) != 0) log.warning(component, fmt::format("'{}' {}", joint, one.text));
  }
}

}  // namespace doppel
